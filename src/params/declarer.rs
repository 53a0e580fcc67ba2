//! Parameters declared where they are read, as rclcpp's `declare_parameter` does it: one expression names a parameter, says what it
//! is, and has its value.

use super::{Constraint, Declaration, List, Value};
use std::collections::HashMap;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Collects what a node declares, in order, and returns each parameter's value at once.
pub struct Declarer {
    values: HashMap<String, Value>,
    declared: Vec<Declaration>,
}

/// A parameter that is being declared: [`live`](Self::live) or [`fixed`](Self::fixed) ends the declaration.
#[must_use]
pub struct Row<'a, T> {
    declarer: &'a mut Declarer,
    declaration: Declaration,
    default: T,
    take: fn(&'static str, Value) -> Option<T>,
}

impl Declarer {
    /// Parameters get these values; those that have none here, or none that fits, their defaults.
    pub fn new(values: impl IntoIterator<Item = (String, Value)>) -> Self {
        Self { values: values.into_iter().collect(), declared: Vec::new() }
    }

    /// What was declared, in that order.
    pub fn into_declarations(self) -> Vec<Declaration> {
        self.declared
    }

    /// A boolean.
    pub fn boolean(&mut self, name: &'static str, default: bool) -> Row<'_, bool> {
        let take = |_, value| if let Value::Bool(value) = value { Some(value) } else { None };
        self.row(name, default, Value::Bool(default), Constraint::None, take)
    }

    /// An integer within a range.
    pub fn integer(&mut self, name: &'static str, default: i64, range: RangeInclusive<i64>) -> Row<'_, i64> {
        let (min, max) = range.into_inner();
        let take = |_, value| if let Value::Integer(value) = value { Some(value) } else { None };
        self.row(name, default, Value::Integer(default), Constraint::IntegerRange { min, max }, take)
    }

    /// A double within a range.
    pub fn double(&mut self, name: &'static str, default: f64, range: RangeInclusive<f64>) -> Row<'_, f64> {
        let take = |_, value| if let Value::Double(value) = value { Some(value) } else { None };
        self.row(name, default, Value::Double(default), Constraint::range(range), take)
    }

    /// Any text, empty by default.
    pub fn string(&mut self, name: &'static str) -> Row<'_, String> {
        let take = |_, value| if let Value::String(text) = value { Some(text) } else { None };
        self.row(name, String::new(), Value::String(String::new()), Constraint::None, take)
    }

    /// What one of these names stands for.
    pub fn one_of<T: FromStr + Display>(
        &mut self,
        name: &'static str,
        names: &'static [&'static str],
        default: T,
    ) -> Row<'_, T> {
        let take = |_, value| if let Value::String(text) = value { text.parse().ok() } else { None };
        let text = Value::String(default.to_string());
        self.row(name, default, text, Constraint::OneOf(names), take)
    }

    /// A list of finite doubles.
    pub fn doubles(&mut self, name: &'static str, default: &[f64]) -> Row<'_, List<f64>> {
        let take = |name, value| {
            if let Value::DoubleArray(list) = value { Some(List::new(name, list)) } else { None }
        };
        let list = List::new(name, default.to_vec());
        self.row(name, list, Value::DoubleArray(default.to_vec()), Constraint::None, take)
    }

    /// A list of texts, empty by default.
    pub fn strings(&mut self, name: &'static str) -> Row<'_, List<String>> {
        let take = |name, value| {
            if let Value::StringArray(list) = value { Some(List::new(name, list)) } else { None }
        };
        let list = List::new(name, Vec::new());
        self.row(name, list, Value::StringArray(Vec::new()), Constraint::None, take)
    }

    fn row<T>(
        &mut self,
        name: &'static str,
        default: T,
        value: Value,
        constraint: Constraint,
        take: fn(&'static str, Value) -> Option<T>,
    ) -> Row<'_, T> {
        let declaration = Declaration {
            name,
            default: value,
            constraint,
            unit: "",
            description: "",
            read_only: false,
            required: false,
        };
        Row { declarer: self, declaration, default, take }
    }
}

impl<T> Row<'_, T> {
    /// The same, but given by whoever describes the robot: no default would serve.
    pub fn required(mut self) -> Self {
        self.declaration.required = true;
        self
    }

    /// The value of a parameter that may change while the node runs; `unit` is empty for none.
    pub fn live(mut self, unit: &'static str, description: &'static str) -> T {
        (self.declaration.unit, self.declaration.description) = (unit, description);
        let Self { declarer, declaration, default, take } = self;
        let given = declarer.values.get(declaration.name).cloned();
        let fitting = given.and_then(|value| declaration.check(value).ok());
        let value = fitting.and_then(|value| take(declaration.name, value)).unwrap_or(default);
        declarer.declared.push(declaration);
        value
    }

    /// The value of a parameter that is fixed at the start; `unit` is empty for none.
    pub fn fixed(mut self, unit: &'static str, description: &'static str) -> T {
        self.declaration.read_only = true;
        self.live(unit, description)
    }
}

impl Row<'_, List<f64>> {
    /// The same, with each number within a range.
    pub fn within(mut self, range: RangeInclusive<f64>) -> Self {
        self.declaration.constraint = Constraint::range(range);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ParameterStore;

    fn declare(p: &mut Declarer) -> (i64, f64, String, Vec<f64>) {
        (
            p.integer("rate", 10, 1..=100).fixed("Hz", "how often"),
            p.double("gain", 0.5, 0.0..=1.0).live("1/s", "how fast"),
            p.one_of("mode", &["slow", "fast"], "slow".to_owned()).live("", "how"),
            p.doubles("limits", &[]).within(0.0..=9.0).required().live("m", "how far").items().to_vec(),
        )
    }

    #[test]
    fn one_expression_declares_and_reads() {
        let mut defaults = Declarer::new([]);
        assert_eq!(declare(&mut defaults), (10, 0.5, "slow".to_owned(), vec![]));
        let declared = defaults.into_declarations();
        let names: Vec<_> = declared.iter().map(|one| (one.name, one.read_only, one.required)).collect();
        let expected =
            [("rate", true, false), ("gain", false, false), ("mode", false, false), ("limits", false, true)];
        assert_eq!(names, expected);
        assert_eq!((declared[1].unit, declared[1].description), ("1/s", "how fast"));
        assert_eq!(declared[1].expected(), "0 to 1 1/s");

        let mut store = ParameterStore::new(declared, Vec::new());
        store.override_initial("limits", Value::IntegerArray(vec![1, 2])).unwrap();
        let store = store.with(&[("gain".to_owned(), Value::Integer(1))]).unwrap();
        let values = store.values();
        assert_eq!(declare(&mut Declarer::new(values)), (10, 1.0, "slow".to_owned(), vec![1.0, 2.0]));
    }

    #[test]
    fn texts_are_bound_by_nothing_and_lists_keep_their_name() {
        let mut p = Declarer::new([("joints".to_owned(), Value::StringArray(vec!["a".to_owned()]))]);
        let joints = p.strings("joints").fixed("", "the joints");
        assert_eq!(joints.items(), ["a"]);
        let error = joints.invalid("one", "two").to_string();
        assert_eq!(error, "parameter \"joints\" cannot be one: expected two");
        let numbers = p.doubles("numbers", &[1.0]).live("m", "some");
        assert_eq!(numbers.exactly_or_none(1), Ok(Some(&[1.0][..])));
        let error = numbers.exactly(2).unwrap_err().to_string();
        assert_eq!(error, "parameter \"numbers\" cannot be a list of 1: expected 2 numbers");
        assert_eq!(p.into_declarations()[0].expected(), "");
    }
}
