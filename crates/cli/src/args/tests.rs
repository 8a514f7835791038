//! Valid and invalid command lines.

use super::*;
use clap::CommandFactory;

fn parse(line: &str) -> Result<Cli, clap::Error> {
    Cli::try_parse_from(line.split_whitespace())
}

#[test]
fn definitions_are_consistent() {
    Cli::command().debug_assert();
}

#[test]
fn commands_are_read() {
    let cli = parse("slipstick optimize case.toml --out o --threads 2 -vv").expect("right");
    assert_eq!((cli.common.threads.map(NonZeroUsize::get), cli.common.verbose), (Some(2), 2));
    let Command::Optimize(optimize) = cli.command else { panic!("optimize") };
    assert_eq!(optimize.case.case, PathBuf::from("case.toml"));
    assert_eq!(optimize.out.out, Some(PathBuf::from("o")));

    let cli = parse("slipstick --json verify gradient case.toml --step 1e-3").expect("right");
    assert!(cli.common.json);
    let Command::Verify(Verify { what: VerifyWhat::Gradient(gradient) }) = cli.command else {
        panic!("verify gradient")
    };
    assert_eq!((gradient.step, gradient.elements, gradient.halvings), (1e-3, 5, 3));
    assert_eq!(gradient.directions, 2);

    let cli = parse("slipstick evaluate c.toml --design o --friction 0,0.1,0.25").expect("right");
    let Command::Evaluate(evaluate) = cli.command else { panic!("evaluate") };
    assert_eq!(evaluate.friction, [0.0, 0.1, 0.25]);
    let Command::Bench(bench) =
        parse("slipstick bench --sizes 100,900 --threads 1,2 --memory 2GiB").expect("right").command
    else {
        panic!("bench")
    };
    assert_eq!((bench.sizes.len(), bench.threads.len(), bench.memory), (2, 2, Some(Memory(2 << 30))));
    let Command::Study(study) = parse("slipstick study s.toml --only a,b --plan").expect("right").command else {
        panic!("study")
    };
    assert_eq!((study.only.len(), study.plan), (2, true));
    let line = "slipstick solve c.toml --set contact[0].friction=0.1 --set objective.contact_force.steps=all";
    let Command::Solve(solve) = parse(line).expect("right").command else { panic!("solve") };
    assert_eq!(solve.case.set[1].to_string(), "objective.contact_force.steps=all");
    for line in ["new", "new ironing --force", "check c.toml --resolved", "solve c.toml", "resume o"] {
        parse(&format!("slipstick {line}")).expect("right");
    }
}

/// Invalid command lines end with exit code 2, like invalid case files; help does not.
#[test]
fn wrong_command_lines_exit_with_2() {
    for line in [
        "optimise c.toml",
        "solve",
        "solve c.toml --threads 0",
        "evaluate c.toml",
        "evaluate c.toml --design o --friction -0.1",
        "evaluate c.toml --design o --friction nan",
        "verify gradient c.toml --step 2",
        "check c.toml -q -v",
        "check c.toml --set friction",
        "check c.toml --set contact[x].friction=1",
    ] {
        let error = parse(&format!("slipstick {line}")).expect_err(line);
        assert_eq!(error.exit_code(), 2, "{line}");
    }
    assert_eq!(parse("slipstick --help").expect_err("help").exit_code(), 0);
}
