//! Tests the pairwise comparison of laws on the same tasks against textbook values.

use dq_studies::compare::{Interval, holm, sign_test};

fn close(ours: f64, theirs: f64, to: f64) {
    assert!((ours - theirs).abs() <= to, "{ours} {theirs}");
}

#[test]
fn the_sign_test_is_exact() {
    // 9 of 10: 2·(1 + 10)/2¹⁰. None of 20: 2/2²⁰. Equal numbers: 1, never more.
    close(sign_test(1, 9), 22.0 / 1024.0, 1e-15);
    close(sign_test(0, 20), 2.0_f64.powi(-19), 1e-18);
    assert_eq!([sign_test(5, 5), sign_test(0, 0), sign_test(3, 4)], [1.0; 3]);
    assert_eq!(sign_test(86, 150), sign_test(150, 86));
}

/// Approval of a prime minister, asked twice of 1600 people (Agresti, Categorical Data Analysis, 2002, table 10.1): 150 changed to no, 86
/// to yes; z² = 17.36, and the interval of the difference is 4.0 ± 1.96·0.95 points.
#[test]
fn pairs_are_compared_as_in_agresti_s_book() {
    // The two-sided probability of the normal distribution beyond √17.36.
    let p = sign_test(150, 86);
    assert!((2.5e-5..4.5e-5).contains(&p), "{p}");
    let difference = Interval::paired_share(150, 86, 1600, 1.96);
    close(difference.value, 4.0, 1e-12);
    close(difference.low, 4.0 - 1.96 * 0.95, 0.02);
    close(difference.high, 4.0 + 1.96 * 0.95, 0.02);
    let none = Interval::paired_share(0, 0, 10, 1.96);
    assert!(none.low < 0.0 && none.high > 0.0 && none.value == 0.0, "{none:?}");
}

/// The result of R's `p.adjust(c(0.01, 0.04, 0.03, 0.02), "holm")`.
#[test]
fn holm_s_probabilities_are_those_of_r() {
    let ours = holm(&[0.01, 0.04, 0.03, 0.02]);
    for (ours, theirs) in ours.iter().zip([0.04, 0.06, 0.06, 0.06]) {
        close(*ours, theirs, 1e-15);
    }
    assert_eq!(holm(&[0.5, 0.9]), [1.0, 1.0]);
    assert!(holm(&[]).is_empty());
}
