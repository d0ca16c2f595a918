//! Completions and manual pages.

use crate::place::Place;
use std::process::Command;

/// What a program of the system prints; `None` where the system lacks it.
fn system(place: &Place, program: &str, arguments: &[&str]) -> Option<(bool, String)> {
    let output = Command::new(program).args(arguments).current_dir(place.path(".")).output().ok()?;
    let text = [output.stdout, output.stderr].concat();
    Some((output.status.success(), String::from_utf8_lossy(&text).into_owned()))
}

#[test]
fn a_shell_completes_commands_and_options() {
    let place = Place::with(&[]);
    for (shell, part) in [("bash", "complete -F"), ("zsh", "#compdef gyroid"), ("fish", "complete -c gyroid")] {
        let text = place.ok(&format!("completions {shell}"));
        assert!(text.contains(part) && text.contains("navigate"), "{shell}");
        place.write(shell, &text);
        if let Some((sound, said)) = system(&place, shell, &["-n", shell]) {
            assert!(sound && said.is_empty(), "{shell}: {said}");
        }
    }
    place.refused("completions bas", 2, &["bash"]);
    // as bash asks, with the cursor after the word that is begun
    let ask = |words: &str, at: usize| {
        let script = format!(
            "source ./bash; COMP_WORDS=({words}); COMP_CWORD={at}; _gyroid gyroid \"${{COMP_WORDS[{at}]}}\" \"${{COMP_WORDS[{}]}}\"; echo \"${{COMPREPLY[@]}}\"",
            at - 1
        );
        system(&place, "bash", &["-c", &script]).map(|(_, said)| said.trim().to_string())
    };
    if let Some(found) = ask("gyroid nav", 1) {
        assert_eq!(found, "navigate");
        assert_eq!(ask("gyroid gap diag", 2).unwrap(), "diagnose");
        assert_eq!(ask("gyroid gap diagnose --write-s", 3).unwrap(), "--write-sim");
        assert_eq!(ask("gyroid init --kind re", 3).unwrap(), "rest");
    }
}

#[test]
fn every_command_has_a_manual_page_that_renders() {
    let place = Place::with(&[]);
    assert!(place.ok("man").contains(".TH GYROID 1"));
    std::fs::create_dir(place.path("man1")).unwrap();
    place.ok("man -o man1");
    let pages: Vec<String> =
        std::fs::read_dir(place.path("man1")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    for name in ["gyroid.1", "gyroid-fit.1", "gyroid-gap-diagnose.1", "gyroid-init.1", "gyroid-demo.1"] {
        assert!(pages.iter().any(|p| p == name), "{name} of {pages:?}");
    }
    assert!(!pages.iter().any(|p| p.contains("help")), "{pages:?}");
    let page = place.read("man1/gyroid-init.1");
    assert!(page.contains(".SH EXAMPLES") && page.contains("gyroid init \\-\\-urdf husky.urdf"), "{page}");
    for name in &pages {
        let path = format!("man1/{name}");
        // groff warns of what a page lacks, -ww of all it sees
        if let Some((sound, said)) = system(&place, "groff", &["-man", "-Tutf8", "-ww", "-z", &path]) {
            assert!(sound && said.is_empty(), "{name}: {said}");
        }
    }
    // its own pages it replaces, others not
    place.ok("man -o man1");
    place.write("man1/gyroid-fit.1", "mine");
    place.refused("man -o man1", 1, &["gyroid-fit.1", "gyroid did not write it"]);
    place.refused("man -o nowhere", 1, &["nowhere", "no directory"]);
}

#[test]
fn colours_are_for_terminals_and_not_against_the_users_will() {
    let place = Place::with(&[(
        "g.toml",
        "schema = 1\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\ntime_constant_s = 100.0\nangle_random_walk_rad_sqrt_s = 2e-4\n",
    )]);
    place.ok("simulate g.toml --duration 1200 --sample-time 0.5 --seed 1 -o log.csv");
    let fit = |variables: &[(&str, &str)]| {
        let mut command = assert_cmd::Command::cargo_bin("gyroid").unwrap();
        command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE").envs(variables.iter().copied());
        let output = command.current_dir(place.path(".")).args(["fit", "log.csv"]).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    assert!(fit(&[]).starts_with("FIT FOR USE:"));
    let forced = fit(&[("CLICOLOR_FORCE", "1")]);
    assert!(forced.starts_with("\u{1b}[") && forced.contains("FIT FOR USE\u{1b}[0m:"), "{forced:?}");
    assert!(fit(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]).starts_with("FIT FOR USE:"));
}
