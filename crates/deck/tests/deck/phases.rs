//! What steps change.

use super::{CUBES, refused, tables};

/// Steps change the coefficient of friction, within their first load step, and the law of the pressure, from one pair
/// to another.
#[test]
fn steps_change_laws_of_surfaces() {
    let with = |later: &str| CUBES.to_owned() + later;
    let pairs = |deck: &str| {
        let all = tables(deck);
        all.into_iter().filter(|table| table.starts_with("[[contact]]")).collect::<Vec<_>>()
    };
    let step = "*STEP\n*STATIC\n0.5, 1\n";
    let friction = with(&format!(
        "{step}*CHANGE FRICTION, INTERACTION=dry\n*FRICTION\n0.1\n*END STEP\n\
         *STEP\n*STATIC\n*CHANGE FRICTION, INTERACTION=DRY\n*FRICTION\n0.4\n*END STEP\n{step}*END STEP\n"
    ));
    let [pair] = &pairs(&friction)[..] else { panic!("one pair") };
    // 2 + 2 + 1 + 2 load steps: 0.3 until 2/7, 0.1 at 3/7 and 4/7, 0.4 from 5/7 on
    let [a, b, c, d] = [2.0, 3.0, 4.0, 5.0].map(|n: f64| n / 7.0);
    let factors = [0.3 / 0.4, 0.1 / 0.4];
    let expected = format!(
        "friction = 0.4; friction_path = [{{ t = {a:?}, factor = {:?} }}, {{ t = {b:?}, factor = {:?} }}, \
         {{ t = {c:?}, factor = {:?} }}, {{ t = {d:?}, factor = 1.0 }}]; adjust",
        factors[0], factors[1], factors[1]
    );
    assert!(pair.contains(&expected), "{pair}");
    // the last change of a step counts
    let twice =
        friction.replace("*FRICTION\n0.4\n", "*FRICTION\n0.7\n*CHANGE FRICTION, INTERACTION=DRY\n*FRICTION\n0.4\n");
    assert_ne!(twice, friction);
    assert_eq!(pairs(&twice), pairs(&friction));
    let law = with(&format!(
        "{step}*CHANGE SURFACE BEHAVIOR, INTERACTION=DRY\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n5e4\n*END STEP\n"
    ))
    .replace("PRESSURE-OVERCLOSURE=HARD\n", "PRESSURE-OVERCLOSURE=TIED\n1e5\n");
    let [tied, free] = &pairs(&law)[..] else { panic!("two pairs") };
    assert!(tied.ends_with("active = [0.0, 0.5]; tied = true"), "{tied}");
    assert!(free.contains("slave = \"HIGH_DOWN_2\"") && free.contains("active = [0.5, 1.0]"), "{free}");
    assert!(free.contains("penalty") && free.contains("friction = 0.3"), "{free}");
    for (deck, why) in [
        (with(&format!("{step}*FRICTION\n0.1\n*END STEP\n")), "in a step, it does not say what it changes"),
        (with(&format!("{step}*CHANGE FRICTION, INTERACTION=WET\n*END STEP\n")), "it needs the INTERACTION="),
        (friction.replace("0.4\n", "0.4, 1e5\n"), "a stick slope or TAUMAX that changes"),
        (with(&format!("{step}*CHANGE FRICTION, INTERACTION=DRY\n*END STEP\n")), "nothing after it says what changes"),
    ] {
        let found = refused(&deck);
        assert!(found[0].contains(why), "{found:?}");
    }
}

/// `FIXED` in a later step keeps nodes where they are: a support without motion that begins then. What moves already
/// stays, and `OP=NEW` ends the support.
#[test]
fn fixed_keeps_what_a_step_has_reached() {
    let with = |later: &str| CUBES.replace("TOP, 1, 2\nTOP, 3, 3, -0.1\n", "TOP, 3, 3, -0.1\n") + later;
    let step = "*STEP\n*STATIC\n0.5, 1\n";
    let supports = |deck: &str| {
        let all = tables(deck);
        all.into_iter().filter(|table| table.starts_with("[[dirichlet]]")).collect::<Vec<_>>()
    };
    let kept = with(&format!("{step}*BOUNDARY, FIXED\nTOP, 1, 3\n*END STEP\n"));
    assert_eq!(
        supports(&kept)[1..],
        [
            "[[dirichlet]]; set = \"HIGH_TOP\"; components = [\"z\"]; motion = [{ t = 0.5, u = [0.0, 0.0, -0.1] }]",
            "[[dirichlet]]; set = \"HIGH_TOP\"; components = [\"x\", \"y\"]; from = 0.5",
        ]
    );
    let ended = kept.clone() + step + "*BOUNDARY, OP=NEW\nBASE, 1, 3\nTOP, 3, 3, -0.1\n*END STEP\n";
    let last = supports(&ended).pop().expect("a support");
    assert!(last.contains("from = 0.3333333333333333; until = 0.6666666666666666"), "{last}");
    let first = CUBES.replace("*BOUNDARY\nBASE", "*BOUNDARY, FIXED\nBASE");
    assert!(refused(&first)[0].contains("before and in the first step, there is nothing"), "{:?}", refused(&first));
    let moved = kept + step + "*BOUNDARY\nTOP, 1, 1, 0.2\n*END STEP\n";
    assert!(refused(&moved)[0].contains("FIXED begins and a later step moves"), "{:?}", refused(&moved));
}
