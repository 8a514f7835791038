//! Wrong loads and symmetry planes.

use super::*;

fn with(load: &str) -> String {
    GOOD.replacen("[load_path]", &format!("{load}\n[load_path]"), 1)
}

/// Line of the first load in the invalid case.
const LINE: usize = 25;

#[test]
fn wrong_loads() {
    use CaseCode::*;
    for (load, code, at, says) in [
        ("[[load]]\nsurface = 'ball_flat'", ChooseOne, (LINE, 1), "the value of the load"),
        ("[[load]]\npressure = 1.0", MissingKey, (LINE, 1), "`surface`"),
        ("[[load]]\nsurface = 'feet'\npressure = 1.0", NotASurface, (LINE + 1, 11), "`feet` is a node set"),
        ("[[load]]\nsurface = 'ball_dom'\npressure = 1.0", UnknownSet, (LINE + 1, 11), "no surface called `ball_dom`"),
        ("[[load]]\nsurface = 'ball_flat'\npressure = 0.0", OutOfRange, (LINE + 2, 12), "is a load of zero"),
        ("[[load]]\nsurface = 'ball_flat'\ntraction = 3.0", WrongType, (LINE + 2, 12), "traction"),
        ("[[load]]\nsurface = 'ball_flat'\nforce = [0, 0, 0]", OutOfRange, (LINE + 2, 9), "is a load of zero"),
        (
            "[[load]]\nsurface = 'ball_flat'\nforce = [0, 1, 0]\npressure = 2.0",
            ChooseOne,
            (LINE + 2, 9),
            "more than once",
        ),
        (
            "[[load]]\nsurface = 'ball_flat'\npressure = 2.0\namplitude = [{ t = 1.5, factor = 1 }]",
            MotionTime,
            (LINE + 3, 20),
            "(0, 1]",
        ),
        (
            "[[load]]\nsurface = 'ball_flat'\npressure = 2.0\namplitude = [{ t = 1.0, factor = 0 }]",
            Empty,
            (LINE + 3, 13),
            "always zero",
        ),
        ("[[load]]\nsurface = 'ball_flat'\npressure = 2.0\namplitude = 2", WrongType, (LINE + 3, 13), "a list"),
        ("[[load]]\nsurface = 'ball_flat'\npressure = 2.0\namplitude = []", Empty, (LINE + 3, 13), "always zero"),
        ("[[load]]\nsurface = 'ball_flat'\npressure = 2.0\nsuface = 1", UnknownKey, (LINE + 3, 1), "did you mean"),
        ("[[load]]\nsurface = 'ball_flat'\npressure = nan", NotFinite, (LINE + 2, 12), "pressure"),
        ("[[load]]\ngravity = [0, -9.81, 0]", MissingKey, (LINE + 1, 11), "no body has a `mass_density`"),
        (
            "[[load]]\nbody = 'ball'\ngravity = [0, -9.81, 0]",
            MissingKey,
            (LINE + 2, 11),
            "`ball` has no `mass_density`",
        ),
        ("[[symmetry]]\nat = 1.0", MissingKey, (LINE, 1), "`normal`"),
        ("[[symmetry]]\nnormal = 'w'", UnknownWord, (LINE + 1, 10), "`w`"),
        ("[[symmetry]]\nnormal = 'x'\n[[symmetry]]\nnormal = 'x'", DuplicateName, (LINE + 3, 10), "already"),
    ] {
        let text = with(load);
        let help = only_error(&text, code, at);
        // messages about non-numbers contain the correct form themselves
        assert!(!help.is_empty() || [WrongType, NotFinite].contains(&code), "{load}");
        let told = errors(&text).to_string();
        assert!(told.contains(says), "{load}: {told}");
    }
}

/// The same with a body that has mass.
#[test]
fn wrong_loads_on_mass() {
    use CaseCode::*;
    let heavy = GOOD.replacen("name = \"ball\"", "name = \"ball\"\nmass_density = 1.5", 1);
    assert_ne!(heavy, GOOD);
    for (load, code, at, says) in [
        ("surface = 'ball_flat'\ngravity = [0, -9.81, 0]", ChooseOne, (LINE + 2, 11), "not on a surface"),
        ("body = 'bal'\ngravity = [0, -9.81, 0]", UnknownBody, (LINE + 2, 8), "no body called `bal`"),
        ("gravity = [0, 0, 0]", OutOfRange, (LINE + 2, 11), "is a load of zero"),
        (
            "centrifugal = { point = [0, 0, 0], direction = [0, 0, 0], angular_velocity = 1 }",
            OutOfRange,
            (LINE + 2, 48),
            "must not be the zero vector",
        ),
    ] {
        let text = heavy.replacen("[load_path]", &format!("[[load]]\n{load}\n[load_path]"), 1);
        only_error(&text, code, at);
        let told = errors(&text).to_string();
        assert!(told.contains(says), "{load}: {told}");
    }
}

#[test]
fn wrong_temperatures() {
    use CaseCode::*;
    let with =
        |text: &str, table: &str| text.replacen("[load_path]", &format!("[[temperature]]\n{table}\n[load_path]"), 1);
    let cold = with(GOOD, "change = 20");
    only_error(&cold, MissingKey, (LINE + 1, 10));
    let warm = GOOD.replacen("name = \"ball\"", "name = \"ball\"\nthermal_expansion = 1e-5", 1);
    for (table, code, at, says) in [
        ("body = 'plate'\nchange = 20", MissingKey, (LINE + 3, 10), "`plate` has no `thermal_expansion`"),
        ("change = 0", OutOfRange, (LINE + 2, 10), "changes nothing"),
        ("body = 'ball'", MissingKey, (LINE + 1, 1), "`change`"),
        ("set = 'fet'\nchange = 20", UnknownSet, (LINE + 2, 7), "`fet`"),
        ("body = 'ball'\nset = 'feet'\nchange = 20", ChooseOne, (LINE + 3, 7), "cannot be combined"),
    ] {
        let text = with(&warm, table);
        only_error(&text, code, at);
        let told = errors(&text).to_string();
        assert!(told.contains(says), "{table}: {told}");
    }
}
