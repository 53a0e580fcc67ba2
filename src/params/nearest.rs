//! The name that was meant.

/// The name among `known` that looks most like `name`, if one does.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Of two names with the same pairs in common the one with fewer others is nearer.
    let similarity = |known: &str| 1000 * shared_pairs(known, name) / known.len().max(1);
    let best = known.into_iter().max_by_key(|known| similarity(known))?;
    (similarity(best) >= 500).then_some(best)
}

/// How many pairs of neighbouring characters of `a` are in `b` too.
fn shared_pairs(a: &str, b: &str) -> usize {
    a.as_bytes().windows(2).filter(|pair| b.as_bytes().windows(2).any(|other| other == *pair)).count()
}
