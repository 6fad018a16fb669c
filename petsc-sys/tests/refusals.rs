//! Which PETSc the build accepts, and that a refusal is one sentence that names the package.

#[path = "../facts.rs"]
#[allow(dead_code)]
mod facts;
use facts::Facts;

fn facts(text: &str) -> Facts {
    Facts::parse(text).expect("the probe's output is complete")
}

/// Debian 12's and Debian 13's PETSc are accepted.
#[test]
fn accepts_real_double_releases() {
    for version in ["3 18 5", "3 22 5", "4 0 0"] {
        for marker in ["", "\n# 2 \"probe.c\" 3 4\n     "] {
            let found = facts(&format!("# 1 \"probe.c\"\n\nfact double\nfact version {marker}{version}\n"));
            assert_eq!(found.refusal(), None, "{version}");
        }
    }
}

/// Each kind of unsuitable PETSc is refused for its own reason, in one sentence with the package.
#[test]
fn refuses_what_lacks_something() {
    let cases = [
        ("fact double\nfact version 3 17 4", "3.17.4"),
        ("fact double\nfact complex\nfact version 3 18 5", "complex"),
        ("fact version 3 18 5", "precision"),
        ("fact double\nfact wide_indices\nfact version 3 22 5", "64-bit"),
    ];
    for (text, reason) in cases {
        let sentence = facts(text).refusal().expect(text);
        assert!(sentence.contains(reason) && sentence.contains("petsc-dev"), "{sentence}");
        assert!(!sentence.contains('\n') && !sentence.contains(". "), "{sentence}");
    }
}

/// Output that the preprocessor did not finish is not taken for a PETSc.
#[test]
fn needs_a_version() {
    assert_eq!(Facts::parse("fact double"), None);
    assert_eq!(Facts::parse("fact version 3 PETSC_VERSION_MINOR 5"), None);
}
