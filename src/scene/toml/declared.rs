//! Tables whose keys are declared with the shape, material or light that they describe.

use serde_json::Value as Json;

use super::form::{Form, Value};
use super::report::{Placed, Read, Reports};
use super::table::{self, AnyKey, Fields, Key};
use super::value::{Colour, Direction, Flag, NonZero, OneWord, Pair, Vector, Word};
use crate::parameter::{self, Absence, Declaration, Family, Parameter, ParameterKind, Problem};

/// What a file gives for a parameter.
pub(super) enum Given {
    Value(parameter::Value),
    /// The name of a material.
    Name(String),
}

impl Form for ParameterKind {
    type Output = Given;

    fn read(&self, key: &str, value: &Value<'_>, reports: &mut Reports<'_>) -> Read<Given> {
        use parameter::Value;
        let value = match *self {
            ParameterKind::Number(number) => Value::Number(number.read(key, value, reports)?),
            ParameterKind::Pair(each) => Value::Pair(Pair(each).read(key, value, reports)?),
            ParameterKind::Colour(each) => Value::Colour(Colour(each).read(key, value, reports)?),
            ParameterKind::Vector(each) => Value::Vector(Vector(each).read(key, value, reports)?),
            ParameterKind::NonZero(each) => Value::Vector(NonZero(Vector(each)).read(key, value, reports)?),
            ParameterKind::Direction(each) => {
                Value::Vector(Direction(NonZero(Vector(each))).read(key, value, reports)?)
            }
            ParameterKind::Material => return Word.read(key, value, reports).map(Given::Name),
            ParameterKind::Word(words) => Value::Word(OneWord(words).read(key, value, reports)?),
            ParameterKind::Flag => Value::Flag(Flag.read(key, value, reports)?),
        };
        Ok(Given::Value(value))
    }

    fn schema(&self) -> Json {
        match *self {
            ParameterKind::Number(number) => number.schema(),
            ParameterKind::Pair(each) => Pair(each).schema(),
            ParameterKind::Colour(each) => Colour(each).schema(),
            ParameterKind::Vector(each) => Vector(each).schema(),
            ParameterKind::NonZero(each) => NonZero(Vector(each)).schema(),
            ParameterKind::Direction(each) => Direction(NonZero(Vector(each))).schema(),
            ParameterKind::Material => Word.schema(),
            ParameterKind::Word(words) => OneWord(words).schema(),
            ParameterKind::Flag => Flag.schema(),
        }
    }
}

fn key(parameter: &Parameter) -> Key<ParameterKind> {
    let Parameter { name, about, kind, absence, uncounted: _ } = *parameter;
    match absence {
        Absence::Wrong => Key::required(name, kind, about),
        Absence::Means(default) => Key::default(name, kind, default, about),
        Absence::Fine => Key::optional(name, kind, about),
    }
}

/// The keys of a declared table.
pub(super) fn names(declaration: &'static Declaration) -> impl Iterator<Item = &'static str> + Clone {
    declaration.parameters.iter().map(|parameter| parameter.name)
}

/// The schema of a declared table.
pub(super) fn schema(declaration: &Declaration) -> Json {
    let keys: Vec<_> = declaration.parameters.iter().map(key).collect();
    let mut schema = table::schema(keys.iter().map(|key| key as &dyn AnyKey), Some(declaration.name));
    schema["description"] = declaration.about.into();
    table::add_rules(&mut schema, declaration.rules);
    schema
}

/// The values of a declared table, in which materials are still names. They are kept apart, so that a wrong value does
/// not hide a wrong name.
pub(super) struct Values {
    /// The place of the declaration in its family.
    place: usize,
    pub(super) declaration: &'static Declaration,
    /// Each with the byte where it stands.
    given: Vec<(usize, Read<Given>)>,
}

impl Values {
    /// Reads a table by the declaration at a place in its family.
    pub(super) fn read(
        place: usize,
        declaration: &'static Declaration,
        fields: &Fields<'_, '_>,
        reports: &mut Reports<'_>,
    ) -> Values {
        let read = |parameter| {
            let key = key(parameter);
            let given = match parameter.absence {
                Absence::Fine => fields.get_if_there(&key, reports).map(|given| match given {
                    Some(given) => given,
                    None => Given::Value(parameter::Value::Absent),
                }),
                _ => fields.get(&key, reports),
            };
            (fields.place_of(&key), given)
        };
        Values { place, declaration, given: declaration.parameters.iter().map(read).collect() }
    }

    /// What the values describe. `find` gives the index of a material.
    pub(super) fn build<F: Family>(
        &self,
        mut find: impl FnMut(&Placed<String>, &mut Reports<'_>) -> Read<usize>,
        reports: &mut Reports<'_>,
    ) -> Read<F> {
        let mut outcome = Ok(());
        let mut values = Vec::with_capacity(self.given.len());
        for ((at, given), parameter) in self.given.iter().zip(self.declaration.parameters) {
            let value = match given {
                Ok(Given::Value(value)) => Ok(*value),
                Ok(Given::Name(name)) => {
                    find(&Placed { at: *at, value: name.clone() }, reports).map(parameter::Value::Material)
                }
                Err(reported) => Err(*reported),
            };
            values.push(value.unwrap_or_else(|reported| {
                outcome = Err(reported);
                parameter.kind.unknown()
            }));
        }
        let place_of = |problem: &Problem| {
            let mut places = names(self.declaration).zip(&self.given);
            let named = places.find(|(name, _)| *name == problem.parameter);
            let (_, (at, _)) = named
                .unwrap_or_else(|| unreachable!("{} has no {}", self.declaration.what, problem.parameter));
            *at
        };
        let mut warnings = Vec::new();
        let built = F::build(self.place, &values, &mut warnings).map_err(|problem| {
            reports.error_with(place_of(&problem), problem.message.clone(), |_| problem.help.clone())
        });
        for warning in warnings {
            let help = warning.help.as_deref().unwrap_or_default();
            reports.warn(Some(place_of(&warning)), warning.message.clone(), help);
        }
        outcome.and(built)
    }

    /// The same of what names no material.
    pub(super) fn build_alone<F: Family>(&self, reports: &mut Reports<'_>) -> Read<F> {
        self.build(|name, reports| Err(reports.error(name.at, "only materials name materials")), reports)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::{Light, MaterialKind, Shape, SphereParameters};
    use ::toml::de::DeValue;
    use glam::DVec3;
    use std::collections::HashSet;

    /// Of one family: that fields have types of their kinds, and that defaults can be read.
    fn is_sound<F: Family>() {
        for (place, declaration) in F::DECLARATIONS.iter().enumerate() {
            let unknown: Vec<_> =
                declaration.parameters.iter().map(|parameter| parameter.kind.unknown()).collect();
            let mut warnings = Vec::new();
            let built = F::build(place, &unknown, &mut warnings);
            let built = built.unwrap_or_else(|problem| panic!("{problem:?} of what is unknown"));
            assert_eq!(warnings, [], "of what is unknown");
            assert_eq!(built.declaration().map(|own| own.name), Some(declaration.name));
            assert_eq!(built.values().len(), unknown.len(), "{}", declaration.what);
            for parameter in declaration.parameters {
                assert!(!parameter.about.is_empty() && parameter.about.trim() == parameter.about);
                let Absence::Means(default) = parameter.absence else { continue };
                let value = DeValue::parse(default).unwrap_or_else(|error| panic!("{default}: {error}"));
                let mut reports = Reports::alone(default);
                let read = parameter.kind.read(parameter.name, &value, &mut reports).ok();
                let Some(Given::Value(read)) = read else { panic!("{default} of {}", parameter.name) };
                assert!(parameter.uncounted.is_none_or(|value| value == read), "{default}");
            }
        }
        let mut names: Vec<_> = F::DECLARATIONS.iter().map(|declaration| declaration.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), F::DECLARATIONS.len());
    }

    /// Some values of a kind, of which some fit others badly.
    fn examples(kind: ParameterKind) -> Vec<parameter::Value> {
        use parameter::Value;
        let numbers = |limits: parameter::Number| {
            [0.0, 0.5, 1.0, 2.0].into_iter().filter(move |&number| limits.objection(number).is_none())
        };
        let vectors = [DVec3::X, DVec3::Y, DVec3::X * 2.0, DVec3::ONE].map(Value::Vector);
        match kind {
            ParameterKind::Number(limits) => numbers(limits).map(Value::Number).collect(),
            ParameterKind::Pair(limits) => numbers(limits).map(|number| Value::Pair([number; 2])).collect(),
            ParameterKind::Colour(limits) => {
                numbers(limits).map(|number| Value::Colour([number; 3])).collect()
            }
            ParameterKind::Vector(_) => [&vectors[..], &[Value::Vector(DVec3::ZERO)]].concat(),
            ParameterKind::NonZero(_) => vectors.to_vec(),
            ParameterKind::Direction(_) => vectors[..2].to_vec(),
            ParameterKind::Material => vec![Value::Material(0), Value::Material(1)],
            ParameterKind::Word(words) => (0..words.len().min(2)).map(Value::Word).collect(),
            ParameterKind::Flag => vec![Value::Flag(false), Value::Flag(true)],
        }
    }

    /// The parameters that problems and warnings about values name.
    fn named<F: Family>(place: usize, values: &[parameter::Value]) -> Vec<&'static str> {
        let mut warnings = Vec::new();
        let problem = F::build(place, values, &mut warnings).err();
        problem.into_iter().chain(warnings).map(|problem| problem.parameter).collect()
    }

    /// Of one family: that what checks find is about a parameter that exists, and does not hang on a value that is
    /// unknown. Of several errors a check finds the first, so that without the value of that one it may find another.
    /// Adds the declarations and parameters about which something was found.
    fn checks_are_sound<F: Family>(found: &mut HashSet<(&'static str, &'static str)>) {
        for (place, declaration) in F::DECLARATIONS.iter().enumerate() {
            let mut combinations = vec![Vec::new()];
            for parameter in declaration.parameters {
                let mut examples = examples(parameter.kind);
                if parameter.absence == Absence::Fine {
                    // Not all of them, as several such parameters have many combinations.
                    examples.truncate(2);
                    examples.push(parameter::Value::Absent);
                }
                assert!(!examples.is_empty(), "{} of {}", parameter.name, declaration.what);
                let longer = |values: &Vec<_>| {
                    let values = values.clone();
                    examples.iter().map(move |&example| [&values[..], &[example]].concat())
                };
                combinations = combinations.iter().flat_map(longer).collect();
            }
            for values in combinations {
                let problems = named::<F>(place, &values);
                let is_wrong = F::build(place, &values, &mut Vec::new()).is_err();
                for &parameter in &problems {
                    assert!(
                        names(declaration).any(|name| name == parameter),
                        "{} has no {parameter}",
                        declaration.what
                    );
                    found.insert((declaration.name, parameter));
                }
                for (i, parameter) in declaration.parameters.iter().enumerate() {
                    if values[i] == parameter::Value::Absent {
                        continue;
                    }
                    let mut unread = values.clone();
                    unread[i] = parameter.kind.unknown();
                    let told = named::<F>(place, &unread);
                    assert!(
                        told.iter().all(|told| problems.contains(told) || is_wrong),
                        "{told:?} of {}, without {}: {values:?}",
                        declaration.what,
                        parameter.name
                    );
                }
            }
        }
    }

    #[test]
    fn checks_name_parameters_and_say_nothing_of_what_is_unknown() {
        let mut found = HashSet::new();
        checks_are_sound::<Shape>(&mut found);
        checks_are_sound::<MaterialKind>(&mut found);
        checks_are_sound::<Light>(&mut found);
        for known in [("plane", "distance"), ("quad", "v"), ("cylinder", "to"), ("box", "max")] {
            assert!(found.contains(&known), "nothing was found about {known:?}");
        }
    }

    #[test]
    fn members_know_the_places_of_their_declarations() {
        let sphere = SphereParameters { center: DVec3::ZERO, radius: 1.0 };
        let place = Shape::from(sphere).place().expect("a place");
        assert_eq!(Shape::DECLARATIONS[place].name, "sphere");
        assert_eq!(Shape::Mesh { mesh: Default::default(), transform: Default::default() }.place(), None);
    }

    #[test]
    fn declarations_are_sound() {
        is_sound::<Shape>();
        is_sound::<MaterialKind>();
        is_sound::<Light>();
    }
}
