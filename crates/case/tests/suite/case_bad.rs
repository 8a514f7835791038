//! Invalid case files: each with the code and the place of its error, all errors at once.

mod loads;
mod quantities;
mod sections;

use slipstick_case::file::{CaseCode, CaseErrors, Severity, parse_case};

/// A valid case; the tests break one line of it.
const GOOD: &str = r#"title = "good"
[[body]]
name = "plate"
box = { min = [0, 0, 0], max = [4, 1, 4], elements = [4, 1, 4] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[body]]
name = "ball"
half_ball = { radius = 1.0, elements = [2, 1, 1] }
place = { rotate = { axis = [0, 1, 0], degrees = 45 }, translate = [2, 2, 2] }
material = { neo_hooke = { youngs_modulus = 1000.0, poisson_ratio = 0.3 } }
[[set]]
name = "feet"
within = "plate_ymin"
boxes = [{ min = [0, 0, 0], max = [1, 0, 1] }]
[[contact]]
slave = "ball_dome"
master = "plate_ymax"
friction = 0.3
enforcement = { lagrange = {} }
[[dirichlet]]
set = "feet"
[[dirichlet]]
set = "ball_flat"
motion = [{ t = 0.5, u = [0, -1, 0] }, { t = 1.0, u = [1, -1, 0] }]
[load_path]
steps = 10
[design]
bodies = ["plate"]
initial = 0.3
volume_fraction = 0.3
simp = { p = 3, min = 1e-3 }
sensitivity_filter = { radius = 0.5 }
[objective]
contact_force = { steps = "last" }
[optimizer]
mma = { move_limit = 0.1 }
iterations = 30
[output]
every = 10
[solver]
linear = "auto"
"#;

fn errors(text: &str) -> CaseErrors {
    match parse_case(text, "case.toml") {
        Err(errors) => errors,
        Ok(_) => panic!("no error in\n{text}"),
    }
}

/// Breaks line `line` of the valid case by replacing `from`, and expects exactly one error, with
/// this code, at the first place where `at` begins on or after that line. Returns its help.
#[track_caller]
fn one(line: usize, from: &str, to: &str, code: CaseCode, at: &str) -> String {
    let (text, start) = spoil(line, from, to);
    let place = start + text[start..].find(at).expect("the marked text follows");
    let before = &text[..place];
    let column = 1 + before.chars().rev().take_while(|&c| c != '\n').count();
    let line = 1 + before.matches('\n').count();
    only_error(&text, code, (line, column))
}

/// The same with the place as line and column.
#[track_caller]
fn one_at(line: usize, from: &str, to: &str, code: CaseCode, place: (usize, usize)) -> String {
    only_error(&spoil(line, from, to).0, code, place)
}

/// The valid case with one line changed, and where that line starts.
#[track_caller]
fn spoil(line: usize, from: &str, to: &str) -> (String, usize) {
    let mut lines: Vec<String> = GOOD.lines().map(str::to_owned).collect();
    let old = &lines[line - 1];
    assert!(old.contains(from), "line {line} is `{old}`");
    let start = lines[..line - 1].iter().map(|line| line.len() + 1).sum();
    lines[line - 1] = old.replacen(from, to, 1);
    (lines.join("\n"), start)
}

#[track_caller]
fn only_error(text: &str, code: CaseCode, (line, column): (usize, usize)) -> String {
    let errors = errors(text);
    let found: Vec<_> = errors
        .diagnostics()
        .iter()
        .filter(|d| d.severity() == Severity::Error)
        .map(|d| (d.code(), d.line(), d.column()))
        .collect();
    assert_eq!(found, [(code, line, column)], "{errors}");
    let error = errors.diagnostics().iter().find(|d| d.severity() == Severity::Error);
    error.map(|d| d.help().to_owned()).unwrap_or_default()
}

#[test]
fn the_right_case_is_right() {
    let resolved = parse_case(GOOD, "case.toml").unwrap_or_else(|errors| panic!("{errors}"));
    assert!(resolved.warnings.is_empty(), "{:?}", resolved.warnings);
}

#[test]
fn syntax() {
    use CaseCode::Syntax;
    one(1, "\"good\"", "good", Syntax, "good");
    one(26, "steps = 10", "steps = 10\nsteps = 20", Syntax, "steps = 20");
    one(9, "{ rotate", "[{ rotate", Syntax, "material");
    let both = GOOD.replace("\"good\"", "good").replace("every = 10", "every = ten");
    let places: Vec<_> = errors(&both).diagnostics().iter().map(|d| d.line()).collect();
    assert_eq!(places, [1, 39]);
}

#[test]
fn unknown_keys_get_a_suggestion() {
    use CaseCode::UnknownKey;
    let help = one(1, "title", "titel", UnknownKey, "titel");
    assert_eq!(help, "did you mean `title`?");
    let help = one(4, "4] }", "4], grade = 1 }", UnknownKey, "grade");
    assert_eq!(help, "available: min, max, grading, elements");
    let help = one(31, "p = 3", "p = 3, mim = 0", UnknownKey, "mim");
    assert_eq!(help, "did you mean `min`?");
    one(18, "friction = 0.3", "friction = 0.3\nfrction = 1", UnknownKey, "frction");
    one(36, "move_limit", "move_limits", UnknownKey, "move_limits");
    one(19, "lagrange = {}", "lagrange = { c = 3 }", UnknownKey, "c = 3");
    one(40, "[solver]", "[sovler]", UnknownKey, "sovler");
}

#[test]
fn missing_keys_and_choices() {
    use CaseCode::*;
    one_at(18, "friction = 0.3", "", MissingKey, (15, 1));
    one_at(21, "set = \"feet\"", "", MissingKey, (20, 1));
    one(4, "min = [0, 0, 0], ", "", MissingKey, "{ max");
    one(5, ", poisson_ratio = 0.3", "", MissingKey, "{ youngs");
    one_at(5, "material", "#", MissingKey, (2, 1));
    one_at(30, "volume_fraction = 0.3", "", MissingKey, (27, 1));
    one(19, "lagrange = {}", "", ChooseOne, "{");
    one(8, "half_ball =", "box = {}\nhalf_ball =", ChooseOne, "{ radius");
    one(24, "{ t = 0.5, u", "{ u", MissingKey, "{ u");
}

#[test]
fn missing_sections() {
    let errors = errors("title = \"empty\"");
    let found: Vec<_> = errors.diagnostics().iter().map(|d| (d.code(), d.line())).collect();
    assert_eq!(found, [(CaseCode::MissingKey, 1), (CaseCode::MissingKey, 1)]);
    assert!(errors.to_string().contains("the case file needs the key `body`"), "{errors}");
    assert!(errors.to_string().contains("[load_path]"), "{errors}");
}

/// A misspelt key is one error and does not also count as missing; a valid key with a similar name
/// explains nothing.
#[test]
fn a_misspelt_key_is_not_missing_as_well() {
    use CaseCode::*;
    one(18, "friction", "frction", UnknownKey, "frction");
    one(8, "half_ball", "halfball", UnknownKey, "halfball");
    one(25, "load_path", "loadpath", UnknownKey, "loadpath");
    one(24, "{ t = 0.5, u", "{ u", MissingKey, "{ u");
    assert_eq!(one(5, "material = {", "materiel = {", UnknownKey, "materiel"), "did you mean `material`?");
}

/// One wrong key is one error, which names the cause, even if the required key has another name, if
/// one of several is required, or if others depend on it.
#[test]
fn one_wrong_key_is_one_error() {
    use CaseCode::UnknownKey;
    let help = one(5, "neo_hooke", "rubber", UnknownKey, "rubber");
    assert_eq!(help, format!("give one of: {}", slipstick_case::file::LawKind::WORDS.join(", ")));
    let help = one(18, "friction", "friction_coefficient", UnknownKey, "friction_coefficient");
    assert_eq!(help, "did you mean `friction`?");
    let help = one(18, "friction", "mu", UnknownKey, "mu");
    assert_eq!(help, "contact[0] needs the key `friction`: the coefficient of friction; 0 is frictionless");
    let help = one(8, "half_ball", "sphere", UnknownKey, "sphere");
    assert!(help.starts_with("give one of: box, ball, half_ball"), "{help}");
    one(5, "youngs_modulus", "E", UnknownKey, "E = 1000");
    one(34, "contact_force", "stiffness", UnknownKey, "stiffness");
    one(15, "[[contact]]", "[[contat]]", UnknownKey, "contat");
    one(11, "[[set]]", "[[sets]]", UnknownKey, "sets");
    // two keys are missing, and one wrong key explains one of them
    let text = GOOD.replace("{ radius = 1.0, elements = [2, 1, 1] }", "{ radios = 1.0 }");
    let found: Vec<_> = errors(&text).diagnostics().iter().map(|d| d.message().to_owned()).collect();
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(
        found.iter().any(|m| m.contains("needs the key `elements`")) && found.iter().any(|m| m.contains("`radios`"))
    );
}

#[test]
fn wrong_types() {
    use CaseCode::WrongType;
    one(18, "0.3", "\"0.3\"", WrongType, "\"0.3\"");
    one(26, "10", "10.0", WrongType, "10.0");
    one(4, "[0, 0, 0]", "[0, 0]", WrongType, "[0, 0]");
    one(4, "[4, 1, 4] }", "[4, 1.5, 4] }", WrongType, "1.5");
    one(16, "\"ball_dome\"", "3", WrongType, "3");
    one(28, "[\"plate\"]", "\"plate\"", WrongType, "\"plate\"");
    one(27, "[design]", "[[design]]", WrongType, "[[design]]");
    one(11, "[[set]]", "[set]", WrongType, "[set]");
    one(41, "\"auto\"", "1979-05-27", WrongType, "1979");
    one(4, "{ min = [0, 0, 0], max = [4, 1, 4], elements = [4, 1, 4] }", "1", WrongType, "1");
    one(19, "{ lagrange = {} }", "\"lagrange\"", WrongType, "\"lagrange\"");
    one(34, "\"last\"", "7", WrongType, "7");
}

#[test]
fn numbers_that_are_none() {
    use CaseCode::NotFinite;
    one(5, "1000.0", "nan", NotFinite, "nan");
    one(18, "0.3", "inf", NotFinite, "inf");
    one(24, "-1, 0", "-inf, 0", NotFinite, "-inf");
    one(32, "0.5", "1e999", NotFinite, "1e999");
}

#[test]
fn unknown_names_get_a_suggestion() {
    use CaseCode::*;
    let help = one(16, "ball_dome", "ball_dom", UnknownSet, "\"ball_dom\"");
    assert_eq!(help, "did you mean `ball_dome`?");
    let help = one(21, "feet", "feat", UnknownSet, "\"feat\"");
    assert_eq!(help, "did you mean `feet`?");
    let help = one(28, "plate", "plaet", UnknownBody, "\"plaet\"");
    assert_eq!(help, "did you mean `plate`?");
    one(17, "plate_ymax", "plate_top", UnknownSet, "\"plate_top\"");
    one(13, "plate_ymin", "feet", UnknownSet, "\"feet\"");
    let help = one(17, "plate_ymax", "feet", NotASurface, "\"feet\"");
    assert!(help.ends_with("plate_zmax, ball_flat, ball_dome"), "{help}");
}

#[test]
fn names_given_twice_or_badly() {
    use CaseCode::*;
    let help = one(17, "plate_ymax", "ball_dome", SameSurface, "\"ball_dome\"");
    assert!(help.contains("penalty"), "{help}");
    let with_itself =
        GOOD.replace("plate_ymax\"\nfriction", "ball_dome\"\nfriction").replace("lagrange = {}", "penalty = {}");
    assert!(parse_case(&with_itself, "case.toml").is_ok());
    one(28, "[\"plate\"]", "[\"plate\", \"plate\"]", DuplicateName, "\"plate\"]");
    one(23, "ball_flat", "feet", ConflictingDirichlet, "\"feet\"");
    // Nothing follows from a name that cannot be read: the surfaces named after it are not reported
    // as well.
    one(7, "\"ball\"", "\"a ball\"", BadName, "\"a ball\"");
    one(7, "\"ball\"", "\"\"", BadName, "\"\"");
}

#[test]
fn duplicate_bodies_sets_and_pairs() {
    let set = "[[set]]\nname = \"plate_xmin\"\nboxes = [{ min = [0, 0, 0], max = [1, 1, 1] }]\n";
    only_error(&format!("{GOOD}{set}"), CaseCode::DuplicateName, (43, 8));
    let body = "[[body]]\nname = \"ball\"\nbox = { min = [0, 0, 0], max = [1, 1, 1], elements = \
                [1, 1, 1] }\nmaterial = { neo_hooke = { youngs_modulus = 1, poisson_ratio = 0 } }\n";
    only_error(&format!("{GOOD}{body}"), CaseCode::DuplicateName, (43, 8));
    let pair = "[[contact]]\nslave = \"ball_dome\"\nmaster = \"plate_ymax\"\nfriction = 0\n";
    only_error(&format!("{GOOD}{pair}"), CaseCode::DuplicateName, (42, 1));
}

#[test]
fn joined_surfaces() {
    use CaseCode::*;
    let with = |of: &str| format!("[[surface]]\nname = \"all\"\nof = {of}\n[[contact]]");
    one(15, "[[contact]]", &with("[]"), Empty, "[]");
    one(15, "[[contact]]", &with("[\"plate_ymax\", \"ball\"]"), UnknownSet, "\"ball\"");
    one(15, "[[contact]]", &with("[\"plate_ymax\", \"plate_ymax\"]"), DuplicateName, "\"plate_ymax\"]");
    one(15, "[[contact]]", &with("[\"plate_ymax\"]\nbody = \"plate\""), UnknownKey, "body");
}

/// What pairs may do besides Coulomb friction.
#[test]
fn joints() {
    use CaseCode::*;
    let with = |more: &str| format!("friction = 0.3\n{more}");
    one(18, "friction = 0.3", &with("shear_limit = 0"), OutOfRange, "0\n");
    one(18, "friction = 0.3", &with("offset = \"thin\""), WrongType, "\"thin\"");
    one(18, "friction = 0.3", &with("offset = [{ t = 0.5 }]"), MissingKey, "{ t = 0.5");
    let back = with("offset = [{ t = 0.5, offset = 1 }, { t = 0.2, offset = 0 }]");
    one(18, "friction = 0.3", &back, MotionTime, "0.2");
    for span in ["[0.5]", "[0.5, 0.5]", "[0.2, 1.5]", "[-0.2, 0.5]"] {
        let help = one(18, "friction = 0.3", &with(&format!("active = {span}")), MotionTime, span);
        assert_eq!(help, "two pseudo-times [from, to] with 0 <= from < to <= 1");
    }
    let with_contact = [("shear_limit", "1"), ("offset", "0.1"), ("edge_cover", "0.5"), ("feature_angle", "30")];
    for (key, value) in with_contact.into_iter().chain([("adjust", "0.1"), ("surfaces", "\"smooth\"")]) {
        let tied = format!("tied = true\n{key} = {value}");
        let help = one(18, "friction = 0.3", &tied, ChooseOne, value);
        assert_eq!(help, format!("omit `{key}`, or `tied`"));
    }
    one(18, "friction = 0.3", &with("tied = true"), ChooseOne, "0.3");
    one(18, "friction = 0.3", &with("adjust = 0"), OutOfRange, "0\n");
    one(18, "friction = 0.3", &with("adjust = { distance = -1 }"), OutOfRange, "-1 }");
    one(18, "friction = 0.3", &with("adjust = { nodes = \"nowhere\" }"), UnknownSet, "\"nowhere\"");
    one(18, "friction = 0.3", &with("adjust = { }"), MissingKey, "{ }");
    let tied = GOOD.replace("friction = 0.3", "tied = true");
    assert!(parse_case(&tied, "case.toml").is_ok());
    only_error(&tied.replace("lagrange = {}", "penalty = {}"), Unsupported, (19, 15));
}

/// Five of sixteen elements are solid: 0.3125 of the volume, above 0.3.
#[test]
fn all_errors_come_at_once_in_the_order_of_the_file() {
    let text = GOOD
        .replace("title", "titel")
        .replace("1000.0", "-1000.0")
        .replace("ball_dome", "ball_domo")
        .replace("steps = 10", "steps = 0")
        .replace("\"auto\"", "\"otto\"");
    let errors = errors(&text);
    let found: Vec<_> = errors.diagnostics().iter().map(|d| (d.code(), d.line())).collect();
    use CaseCode::*;
    let expected =
        [(UnknownKey, 1), (YoungsModulus, 5), (YoungsModulus, 10), (UnknownSet, 16), (Steps, 26), (UnknownWord, 41)];
    assert_eq!(found, expected, "{errors}");
    let first = errors.to_string().lines().next().map(str::to_owned);
    let expected = "case.toml:1:1: error: unknown key `titel` at the top level [slipstick::case::unknown_key]";
    assert_eq!(first.as_deref(), Some(expected));
}

/// Columns count characters, not bytes.
#[test]
fn columns_count_characters() {
    let text = GOOD
        .replace("\"good\"", "\"gut\" # größer")
        .replace("name = \"feet\"\nwithin = \"plate_ymin\"", "name = \"füße\"\nwithin = \"plate_ymin\"");
    let text = text.replace("set = \"feet\"", "\"set\" = \"füße\"; x = 1");
    assert_eq!(errors(&text).diagnostics()[0].code(), CaseCode::Syntax);
    let text = "title = \"ü\"\nsolver = { linear = \"ö\", trheads = 2 }\n";
    let found: Vec<_> = errors(text).diagnostics().iter().skip(2).map(|d| (d.code(), d.line(), d.column())).collect();
    assert_eq!(found, [(CaseCode::UnknownWord, 2, 21), (CaseCode::UnknownKey, 2, 26)]);
}

/// A report shows the line, the code and the help.
#[test]
fn miette_renders_the_place() {
    let text = GOOD.replace("friction = 0.3", "frction = 0.3");
    let errors = errors(&text);
    let mut report = String::new();
    for error in errors.diagnostics() {
        let handler = miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::none());
        handler.render_report(&mut report, error).expect("rendered");
    }
    for part in ["case.toml:18:1", "frction = 0.3", "slipstick::case::unknown_key", "did you mean"] {
        assert!(report.contains(part), "{part} in\n{report}");
    }
}

/// If anything is missing or doubled, the reader gives an answer and does not panic.
#[test]
fn mutilated_files_never_panic() {
    for place in 0..GOOD.len() {
        let without = format!("{}{}", &GOOD[..place], &GOOD[place + 1..]);
        let doubled = format!("{}{}", &GOOD[..=place], &GOOD[place..]);
        for text in [&GOOD[..place], &without, &doubled] {
            if let Err(errors) = parse_case(text, "case.toml") {
                assert!(!errors.diagnostics().is_empty());
                assert!(errors.diagnostics().iter().all(|d| d.line() >= 1 && d.column() >= 1));
            }
        }
    }
}
