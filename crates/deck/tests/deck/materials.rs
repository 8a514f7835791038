//! Materials, and their axes.

use super::{CUBES, line_of, refused, tables, translated};

#[test]
fn materials() {
    let law = |options: &str| {
        let deck = CUBES.replace("*ELASTIC\n1000, 0.3\n", options);
        let table = tables(&deck).remove(0);
        table.split("material = ").nth(1).expect("a material").split("; element").next().expect("a material").to_owned()
    };
    // μ = 2, K = 2/D1 = 4: E = 9Kμ/(3K + μ) = 72/14, ν = (3K − 2μ)/(2(3K + μ)) = 8/28
    let neo_hooke = law("*HYPERELASTIC, NEO HOOKE\n1.0, 0.5\n");
    assert!(
        neo_hooke.contains("youngs_modulus = 5.142857142857143, poisson_ratio = 0.2857142857142857"),
        "{neo_hooke}"
    );
    assert!(neo_hooke.contains("form = \"isochoric\""));
    assert_eq!(
        law("*HYPERELASTIC, YEOH\n1, 0.1, 0.01, 0.1\n"),
        "{ yeoh = { c10 = 1.0, c20 = 0.1, c30 = 0.01, bulk_modulus = 20.0 } }"
    );
    // 2μ/α² there is μ/α here, and D1 = 0 is K = 20 μ₀ with μ₀ = ½ Σ μ α = 1.5 + 0.5
    assert_eq!(
        law("*HYPERELASTIC, OGDEN, N=2\n1.5, 2, 0.5, -2, 0, 0\n"),
        "{ ogden = { mu = [1.5, -0.5], alpha = [2.0, -2.0], bulk_modulus = 40.0 } }"
    );
    assert_eq!(
        law("*ELASTIC\n1000, 0.3\n*PLASTIC\n10, 0\n12, 0.1\n"),
        "{ j2_table = { youngs_modulus = 1000.0, poisson_ratio = 0.3, yield_stress = [10.0, 12.0], plastic_strain = [0.0, 0.1] } }"
    );
    let reduced = tables(&CUBES.replace("TYPE=C3D8", "TYPE=C3D8R"));
    assert!(reduced[0].ends_with("; element = \"f_bar\""), "{reduced:?}");
    let large = tables(&CUBES.replace("*STEP", "*STEP, NLGEOM"));
    assert!(large[0].contains("{ st_venant_kirchhoff = {"), "{large:?}");
}

/// The law of the lower cube, its axes, and how `*ORIENTATION` is treated.
#[test]
fn orthotropic_materials() {
    let deck = |elastic: &str, orientation: &str| {
        let deck = CUBES.replace("*ELASTIC\n1000, 0.3\n", &format!("{elastic}{orientation}"));
        deck.replace("ELSET=LOW, MATERIAL=steel", "ELSET=LOW, MATERIAL=steel, ORIENTATION=grain")
    };
    let engineering = "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n12e3, 800, 600, 0.4, 0.5, 0.3, 700, 650,\n60\n";
    let constants = "{ orthotropic = { e1 = 12000.0, e2 = 800.0, e3 = 600.0, nu12 = 0.4, nu13 = 0.5, nu23 = 0.3, \
                     g12 = 700.0, g13 = 650.0, g23 = 60.0";
    // axis 1 along z, and axis 2 in the plane of z and x
    for (data, axes) in [
        ("0,0,2, 1,0,3", "axis1 = [0.0, 0.0, 1.0], axis2 = [1.0, 0.0, 0.0]"),
        ("1,1,3, 2,1,4, 1,1,1", "axis1 = [0.0, 0.0, 1.0], axis2 = [1.0, 0.0, 0.0]"),
        ("0,0,2, 1,0,3\n2, 0", "axis1 = [0.0, 0.0, 1.0], axis2 = [1.0, 0.0, 0.0]"),
    ] {
        let deck = deck(engineering, &format!("*ORIENTATION, NAME=GRAIN\n{data}\n"));
        let found = tables(&deck);
        assert!(found[0].contains(&format!("{constants}, {axes} }} }}")), "{found:?}");
        assert!(found[1].contains(&format!("{constants} }} }}")), "the other section has global axes: {found:?}");
        let uses = translated(&deck).ledger.uses;
        let how = |keyword: &str| uses.iter().find(|of| of.keyword == keyword).expect(keyword).how.word();
        assert_eq!(["ORIENTATION", "ELASTIC"].map(how), ["translated", "translated"]);
    }
    // 30° about axis 3, which is z: (cos, sin, 0) and (−sin, cos, 0)
    let turned = tables(&deck(engineering, "*ORIENTATION, NAME=GRAIN\n1,0,0, 0,1,0\n3, 30\n"))[0].clone();
    let after = |key: &str| -> Vec<f64> {
        let text = turned.split(&format!("{key} = [")).nth(1).and_then(|rest| rest.split(']').next()).expect(key);
        text.split(", ").map(|number| number.parse().expect(number)).collect()
    };
    let (sin, cos) = (0.5, 0.75_f64.sqrt());
    for (key, expected) in [("axis1", [cos, sin, 0.0]), ("axis2", [-sin, cos, 0.0])] {
        assert!(after(key).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{turned}");
    }
    // the stiffness of an isotropic material, λ = 300, μ = 200: E = μ(3λ + 2μ)/(λ + μ) = 520, ν = λ/(2(λ + μ)) = 0.3
    let stiffness = "*ELASTIC, TYPE=ORTHO\n700, 300, 700, 300, 300, 700, 200, 200,\n200\n";
    let found = tables(&deck(stiffness, "*ORIENTATION, NAME=GRAIN\n1,0,0, 0,1,0\n"))[0].clone();
    for (key, expected) in [("e1", 520.0), ("e2", 520.0), ("e3", 520.0), ("nu12", 0.3), ("nu23", 0.3), ("g13", 200.0)] {
        let text = found.split(&format!("{key} = ")).nth(1).and_then(|rest| rest.split([',', ' ']).next()).expect(key);
        let value: f64 = text.parse().expect(text);
        assert!((value / expected - 1.0).abs() < 1e-14, "{key}: {value}");
    }
    let isotropic = deck("*ELASTIC\n1000, 0.3\n", "*ORIENTATION, NAME=GRAIN\n1,0,0, 0,1,0\n");
    assert_eq!(tables(&isotropic), tables(CUBES));
    for (elastic, orientation, what) in [
        (engineering, "", "there is no orientation `GRAIN`"),
        (engineering, "*ORIENTATION, NAME=GRAIN\n1,0,0, 2,0,0\n", "both points lie on one line"),
        (engineering, "*ORIENTATION, NAME=GRAIN\n1,0,0\n", "six or nine numbers"),
        (engineering, "*ORIENTATION, NAME=GRAIN\n1,0,0, 0,1,0\n4, 30\n", "1, 2 or 3"),
        (
            "*ELASTIC, TYPE=ORTHO\n1, 1, 1, 1, 1, 1, 1, 1,\n1\n",
            "*ORIENTATION, NAME=GRAIN\n1,0,0, 0,1,0\n",
            "no inverse",
        ),
    ] {
        let found = refused(&deck(elastic, orientation));
        assert!(found.len() == 1 && found[0].contains(what), "{found:?}");
    }
    let rows = "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n9, 8, 6, 0.4, 0.5, 0.3, 7, 6,\n5, 20\n9, 8, 6, 0.4, 0.5, 0.3, 7, 6,\n4, 90\n";
    let found = refused(&deck(rows, "*ORIENTATION, NAME=GRAIN\n1,0,0, 0,1,0\n"));
    assert!(found.len() == 1 && found[0].contains("depend on temperature"), "{found:?}");
}

/// Axes that a part defines turn with its instances: one as it is, one by 90° about z.
#[test]
fn axes_of_parts_turn_with_them() {
    let deck = "*PART, NAME=P\n*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n\
                *ELEMENT, TYPE=C3D8, ELSET=ALL\n1, 1,2,3,4,5,6,7,8\n*NSET, NSET=BASE\n1,2,3,4\n\
                *ORIENTATION, NAME=AX\n1,0,0, 0,1,0\n*SOLID SECTION, ELSET=ALL, MATERIAL=WOOD, ORIENTATION=AX\n*END PART\n\
                *ASSEMBLY, NAME=A\n*INSTANCE, NAME=FIRST, PART=P\n*END INSTANCE\n\
                *INSTANCE, NAME=SECOND, PART=P\n5,0,0\n5,0,0, 5,0,1, 90\n*END INSTANCE\n*END ASSEMBLY\n\
                *MATERIAL, NAME=WOOD\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n12e3, 800, 600, 0.4, 0.5, 0.3, 700, 650,\n60\n\
                *STEP\n*STATIC\n*BOUNDARY\nFIRST.BASE, 1, 3\nSECOND.BASE, 1, 3\n*END STEP\n";
    let found = tables(deck);
    for (table, expected) in found.iter().zip([[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]])
    {
        for (key, expected) in ["axis1", "axis2"].into_iter().zip(expected) {
            let list = table.split(&format!("{key} = [")).nth(1).and_then(|rest| rest.split(']').next()).expect(key);
            let axis: Vec<f64> = list.split(", ").map(|number| number.parse().expect(number)).collect();
            assert!(axis.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{key} {axis:?}: {table}");
        }
    }
    // about an edge of each cube, along x in the part and along y in the second instance
    let cylindrical = tables(&deck.replace("NAME=AX\n1,0,0, 0,1,0\n", "NAME=AX, SYSTEM=CYLINDRICAL\n0,1,0, 2,1,0\n"));
    for (table, expected) in
        cylindrical.iter().zip([[[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], [[4.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    {
        let about = table.split("axes_about = { ").nth(1).expect("axes");
        for (key, expected) in ["point", "direction"].into_iter().zip(expected) {
            let list = about.split(&format!("{key} = [")).nth(1).and_then(|rest| rest.split(']').next()).expect(key);
            let found: Vec<f64> = list.split(", ").map(|number| number.parse().expect(number)).collect();
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{key} {found:?}: {table}");
        }
    }
}

/// Cylindrical axes turn about a line, in the section of the lower cube only.
#[test]
fn cylindrical_axes() {
    let elastic = "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n12e3, 800, 600, 0.4, 0.5, 0.3, 700, 650,\n60\n";
    let deck = |data: &str| {
        let orientation = format!("*ORIENTATION, NAME=GRAIN, SYSTEM=CYLINDRICAL\n{data}\n");
        let deck = CUBES.replace("*ELASTIC\n1000, 0.3\n", &format!("{elastic}{orientation}"));
        deck.replace("ELSET=LOW, MATERIAL=steel", "ELSET=LOW, MATERIAL=steel, ORIENTATION=grain")
    };
    let found = tables(&deck("5,0,1, 5,0,3"));
    assert!(found[0].ends_with("; axes_about = { point = [5.0, 0.0, 1.0], direction = [0.0, 0.0, 1.0] }"), "{found:?}");
    assert!(!found[1].contains("axes_about"), "{found:?}");
    // 90° about the axis: axis 1 is tangential
    let turned = tables(&deck("5,0,1, 5,0,3\n3, 90."));
    assert!(turned[0].contains("axis1 = [6.123233995736766e-17, 1.0, 0.0]"), "{turned:?}");
    for data in ["5,0,1", "5,0,1, 5,0,1"] {
        assert!(refused(&deck(data))[0].contains("two different points"), "{data}");
    }
}

/// Constants at the temperature that the step prescribes: with these numbers, CalculiX 2.20 has the reaction −884.448 of a
/// cube between walls, −E α ΔT, and the width 6.81984e-3, (1 + ν) α ΔT. Without temperatures, it uses the first row.
#[test]
fn constants_depend_on_temperature() {
    let tabled = CUBES.replace(
        "1000, 0.3\n",
        "210000., 0.3, 0.\n100000., 0.25, 1000.\n*EXPANSION, ZERO=20.\n12e-6, 0.\n24e-6, 1000.\n*DENSITY\n2., 0.\n1., 100.\n",
    );
    let heated = |initial: &str, given: &str| {
        let sets = "*NSET, NSET=BOTH\n1,2,3,4,5,6,7,8, 11,12,13,14,15,16,17,18\n*NSET, NSET=LOW_NODES, GENERATE\n1, 8\n*INITIAL CONDITIONS, TYPE=TEMPERATURE\n";
        let deck = tabled.replacen("*STEP", &format!("{sets}{initial}\n*STEP"), 1);
        deck.replacen("*BOUNDARY", &format!("*TEMPERATURE\n{given}\n*BOUNDARY"), 1)
    };
    let constants = |deck: &str| -> [f64; 4] {
        let table = tables(deck).remove(0);
        ["youngs_modulus = ", "poisson_ratio = ", "thermal_expansion = ", "mass_density = "].map(|key| {
            let rest = table.split(key).nth(1).unwrap_or_else(|| panic!("{key}: {table}"));
            rest.split([',', ' ', ';']).next().and_then(|number| number.parse().ok()).expect("a number")
        })
    };
    let near = |found: [f64; 4], expected: [f64; 4]| {
        let wrong = found.iter().zip(expected).any(|(a, b)| (a / b - 1.0).abs() > 1e-12);
        assert!(!wrong, "{found:?} instead of {expected:?}");
    };
    let [modulus, ratio, alpha, density] = constants(&heated("BOTH, 100.", "BOTH, 400."));
    near([modulus, ratio, alpha, density], [166_000.0, 0.28, 0.005_328 / 300.0, 1.0]);
    assert!(
        (modulus * alpha * 300.0 - 884.448).abs() < 1e-9 && ((1.0 + ratio) * alpha * 300.0 - 6.81984e-3).abs() < 1e-12
    );
    // beyond the last row, constants remain; a coefficient of a temperature that does not change is that there
    let strain = |at: f64, alpha: f64| alpha * (at - 20.0);
    let hot = (strain(1200.0, 24e-6) - strain(100.0, 13.2e-6)) / 1100.0;
    near(constants(&heated("BOTH, 100.", "BOTH, 1200.")), [100_000.0, 0.25, hot, 1.0]);
    near(constants(&heated("BOTH, 50.", "BOTH, 50.")), [204_500.0, 0.2975, 12.6e-6, 1.5]);
    near(constants(&tabled), [210_000.0, 0.3, 12e-6, 2.0]);
    for wrong in [
        heated("BOTH, 100.", "LOW_NODES, 400."),
        heated("LOW_NODES, 100.", "LOW_NODES, 100."),
        heated("BOTH, 100.", "BOTH, 400.") + "*STEP\n*STATIC\n0.5, 1\n*TEMPERATURE\nBOTH, 20\n*END STEP\n",
    ] {
        let found = refused(&wrong);
        assert!(
            found.len() == 3 && found.iter().all(|why| why.contains("need one temperature of all nodes")),
            "{found:?}"
        );
    }
    let falling = CUBES.replace("1000, 0.3\n", "1000., 0.3, 10.\n900., 0.3, 5.\n");
    assert!(refused(&falling)[0].contains("temperatures must increase"), "{:?}", refused(&falling));
    // rows that are the same do not depend on temperature
    let same = heated("BOTH, 100.", "LOW_NODES, 400.").replace("100000., 0.25", "210000., 0.3");
    let same = same.replace("24e-6", "12e-6").replace("1., 100.", "2., 100.");
    near(constants(&same), [210_000.0, 0.3, 12e-6, 2.0]);
}

/// A law that is not translated is one error, not two.
#[test]
fn other_laws_are_refused_once() {
    for law in
        ["HYPERFOAM\n1., 2., 0.3", "DEFORMATION PLASTICITY\n1000., 0.3, 8., 12., 0.4", "USER MATERIAL, CONSTANTS=1\n1."]
    {
        let deck = CUBES.replace("*ELASTIC\n1000, 0.3", &format!("*{law}"));
        let keyword = law.split(['\n', ',']).next().expect("a keyword");
        let line = line_of(&deck, &format!("*{keyword}"));
        let cure = "write ELASTIC (isotropic, ORTHO or ENGINEERING CONSTANTS), HYPERELASTIC or PLASTIC";
        let ignored = format!("`--ignore \"{keyword}\"` leaves it out");
        assert_eq!(refused(&deck), [format!("{line}: *{keyword}: this law is not supported; {cure}; {ignored}")]);
    }
    let kinematic = CUBES.replace("1000, 0.3\n", "1000, 0.3\n*PLASTIC, HARDENING=KINEMATIC\n5., 0.\n6., 0.1\n");
    assert_eq!(refused(&kinematic).len(), 1, "{:?}", refused(&kinematic));
    assert!(refused(&kinematic)[0].contains("HARDENING=KINEMATIC is not supported; use isotropic hardening"));
}
