//! Tables whose keys are declared with the shape, texture, material or light that they describe.

use ::toml::de::DeValue;
use serde_json::{Value as Json, json};

use super::form::{Form, Value};
use super::report::{Placed, Read, Reports};
use super::table::{self, AnyKey, Fields, Key};
use super::value::{Colour, Direction, Flag, Integer, NonZero, OneWord, Pair, Vector, Word, wrong_type};
use super::varying::{GreyOr, TwoWords};
use crate::parameter::{self, Absence, Declaration, Family, ImageIndex, Parameter, ParameterKind, Varying};
use crate::scene::description::Textured;

/// What a file gives for a parameter.
pub(super) enum Given {
    Value(parameter::Value),
    /// The name of a material.
    Material(String),
    /// The name of a texture.
    Texture(String),
}

/// What a name stands for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    Material,
    Texture,
}

/// The form of a parameter's values.
struct Slot {
    kind: ParameterKind,
    /// Whether numbers and colours may be textures.
    textured: bool,
}

impl Slot {
    /// Whether a value may be the name of a texture.
    fn takes_names(&self) -> bool {
        let always = matches!(
            self.kind,
            ParameterKind::Varying(_) | ParameterKind::Amount(_) | ParameterKind::Texture
        );
        always || self.textured && self.kind.stand_in().is_some()
    }
}

impl Form for Slot {
    type Output = Given;

    fn read(&self, key: &str, value: &Value<'_>, reports: &mut Reports<'_>) -> Read<Given> {
        use parameter::Value;
        // A number in quotes is a mistake.
        if let DeValue::String(word) = value.get_ref()
            && self.takes_names()
            && (self.kind == ParameterKind::Texture || word.trim().parse::<f64>().is_err())
        {
            return Word.read(key, value, reports).map(Given::Texture);
        }
        let value = match self.kind {
            ParameterKind::Number(number) | ParameterKind::Amount(number) => {
                Value::Number(number.read(key, value, reports)?)
            }
            ParameterKind::Texture => return Err(wrong_type(key, "the name of a texture", value, reports)),
            ParameterKind::Pair(each) => Value::Pair(Pair(each).read(key, value, reports)?),
            ParameterKind::Colour(each) => Value::Colour(Colour(each).read(key, value, reports)?),
            ParameterKind::Vector(each) => Value::Vector(Vector(each).read(key, value, reports)?),
            ParameterKind::NonZero(each) => Value::Vector(NonZero(Vector(each)).read(key, value, reports)?),
            ParameterKind::Direction(each) => {
                Value::Vector(Direction(NonZero(Vector(each))).read(key, value, reports)?)
            }
            ParameterKind::Material => return Word.read(key, value, reports).map(Given::Material),
            ParameterKind::Varying(each) => {
                Value::Varying(Varying::Colour(GreyOr(each).read(key, value, reports)?))
            }
            ParameterKind::Integer(least, most) => {
                Value::Number(Integer { least, most }.read(key, value, reports)?.into())
            }
            ParameterKind::Flag => Value::Flag(Flag.read(key, value, reports)?),
            ParameterKind::Word(words) => Value::Word(OneWord(words).read(key, value, reports)?),
            ParameterKind::Words(words) => Value::Words(TwoWords(words).read(key, value, reports)?),
            ParameterKind::Image => {
                let name = Word.read(key, value, reports)?;
                let at = value.span().start;
                Value::Image(ImageIndex(reports.image(&Placed { at, value: name })?))
            }
        };
        Ok(Given::Value(value))
    }

    fn schema(&self) -> Json {
        let schema = match self.kind {
            ParameterKind::Number(number) | ParameterKind::Amount(number) => number.schema(),
            ParameterKind::Texture => return Word.schema(),
            ParameterKind::Pair(each) => Pair(each).schema(),
            ParameterKind::Colour(each) => Colour(each).schema(),
            ParameterKind::Vector(each) => Vector(each).schema(),
            ParameterKind::NonZero(each) => NonZero(Vector(each)).schema(),
            ParameterKind::Direction(each) => Direction(NonZero(Vector(each))).schema(),
            ParameterKind::Material | ParameterKind::Image => Word.schema(),
            ParameterKind::Varying(each) => GreyOr(each).schema(),
            ParameterKind::Integer(least, most) => Integer { least, most }.schema(),
            ParameterKind::Flag => Flag.schema(),
            ParameterKind::Word(words) => OneWord(words).schema(),
            ParameterKind::Words(words) => TwoWords(words).schema(),
        };
        if self.takes_names() { json!({ "anyOf": [schema, Word.schema()] }) } else { schema }
    }
}

fn key(parameter: &Parameter, textured: bool) -> Key<Slot> {
    let Parameter { name, about, kind, absence, uncounted: _ } = *parameter;
    let form = Slot { kind, textured };
    match absence {
        Absence::Wrong => Key::required(name, form, about),
        Absence::Means(default) => Key::default(name, form, default, about),
        Absence::Fine => Key::optional(name, form, about),
    }
}

/// Whether numbers and colours of what is declared may be textures, in a family of which they may: not of a material that
/// names others, which chooses among them.
fn takes_textures(declaration: &Declaration, family_does: bool) -> bool {
    family_does && !declaration.parameters.iter().any(|parameter| parameter.kind == ParameterKind::Material)
}

/// The keys of a declared table.
pub(super) fn names(declaration: &'static Declaration) -> impl Iterator<Item = &'static str> + Clone {
    declaration.parameters.iter().map(|parameter| parameter.name)
}

/// The schema of a declared table, in a family whose numbers and colours may be textures; it may have more keys.
/// `common` declares the parameters that every member of the family has besides.
pub(super) fn schema(
    declaration: &Declaration,
    common: Option<&Declaration>,
    textured: bool,
    more: &'static [&'static dyn AnyKey],
) -> Json {
    let keys_of = |declaration: &Declaration| {
        let textured = takes_textures(declaration, textured);
        declaration.parameters.iter().map(|parameter| key(parameter, textured)).collect::<Vec<_>>()
    };
    let mut keys = keys_of(declaration);
    keys.extend(common.map(keys_of).into_iter().flatten());
    let keys = keys.iter().map(|key| key as &dyn AnyKey).chain(more.iter().copied());
    let mut schema = table::schema(keys, Some(declaration.name));
    schema["description"] = declaration.about.into();
    table::add_rules(&mut schema, declaration.rules);
    schema
}

/// The values of a declared table, in which materials and textures are still names. They are kept apart, so that a wrong
/// value does not hide a wrong name.
pub(super) struct Values {
    /// The place of the declaration in its family.
    place: usize,
    pub(super) declaration: &'static Declaration,
    /// Each with the byte where it stands.
    given: Vec<(usize, Read<Given>)>,
    /// What every member of the family has besides.
    pub(super) common: Option<Box<Values>>,
}

impl Values {
    /// Reads a table by the declaration at a place in its family, of which numbers and colours may be textures.
    pub(super) fn read(
        place: usize,
        declaration: &'static Declaration,
        textured: bool,
        fields: &Fields<'_, '_>,
        reports: &mut Reports<'_>,
    ) -> Values {
        let textured = takes_textures(declaration, textured);
        let read = |parameter| {
            let key = key(parameter, textured);
            let given = match parameter.absence {
                Absence::Fine => fields.get_if_there(&key, reports).map(|given| match given {
                    Some(given) => given,
                    None => Given::Value(parameter::Value::Absent),
                }),
                _ => fields.get(&key, reports),
            };
            (fields.place_of(&key), given)
        };
        Values { place, declaration, given: declaration.parameters.iter().map(read).collect(), common: None }
    }

    /// What the values describe, and the parameters of it that are textures. `find` gives the index of what is wanted.
    pub(super) fn build<F: Family>(
        &self,
        mut find: impl FnMut(Wanted, &Placed<String>, &mut Reports<'_>) -> Read<usize>,
        reports: &mut Reports<'_>,
    ) -> Read<(F, Vec<Textured>)> {
        let mut outcome = Ok(());
        let mut values = Vec::with_capacity(self.given.len());
        let mut textures = Vec::new();
        for ((at, given), parameter) in self.given.iter().zip(self.declaration.parameters) {
            let mut index = |wanted, name: &String, reports: &mut Reports<'_>| {
                find(wanted, &Placed { at: *at, value: name.clone() }, reports)
            };
            let value = match given {
                Ok(Given::Value(value)) => Ok(*value),
                Ok(Given::Material(name)) => {
                    index(Wanted::Material, name, reports).map(parameter::Value::Material)
                }
                Ok(Given::Texture(name)) => index(Wanted::Texture, name, reports).map(|texture| {
                    if let ParameterKind::Varying(_) = parameter.kind {
                        return parameter::Value::Varying(Varying::Texture(texture));
                    }
                    textures.push(Textured { parameter: parameter.name, texture });
                    parameter.kind.unknown()
                }),
                Err(reported) => Err(*reported),
            };
            values.push(value.unwrap_or_else(|reported| {
                outcome = Err(reported);
                parameter.kind.unknown()
            }));
        }
        let mut warnings = Vec::new();
        let mut built = F::build(self.place, &values, &mut warnings);
        if built.is_ok() && !textures.is_empty() {
            // What is a texture was unknown to the checks, which have found nothing.
            for (value, parameter) in values.iter_mut().zip(self.declaration.parameters) {
                if textures.iter().any(|textured| textured.parameter == parameter.name) {
                    *value = parameter.kind.stand_in().unwrap_or(*value);
                }
            }
            built = F::build(self.place, &values, &mut Vec::new());
        }
        let built = built.map_err(|problem| {
            let at = self.place_of(problem.parameter);
            reports.error_with(at, problem.message.clone(), |_| problem.help.clone())
        });
        for warning in warnings {
            let help = warning.help.as_deref().unwrap_or_default();
            reports.warn(Some(self.place_of(warning.parameter)), warning.message.clone(), help);
        }
        outcome.and(built).map(|built| (built, textures))
    }

    /// Where the value of a parameter stands.
    pub(super) fn place_of(&self, parameter: &str) -> usize {
        let common = self.common.as_deref();
        let all = [Some(self), common].into_iter().flatten();
        let mut places = all.flat_map(|values| names(values.declaration).zip(&values.given));
        let named = places.find(|(name, _)| *name == parameter);
        let (_, (at, _)) =
            named.unwrap_or_else(|| unreachable!("{} has no {parameter}", self.declaration.what));
        *at
    }

    /// The same of what names nothing.
    pub(super) fn build_alone<F: Family>(&self, reports: &mut Reports<'_>) -> Read<F> {
        let none = |_, name: &Placed<String>, reports: &mut Reports<'_>| {
            Err(reports.error(name.at, "only materials name materials"))
        };
        self.build(none, reports).map(|(built, _)| built)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::{Light, MaterialKind, Modifiers, Shape, SphereParameters, TextureKind};
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
                let slot = Slot { kind: parameter.kind, textured: true };
                let read = slot.read(parameter.name, &value, &mut reports).ok();
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
            ParameterKind::Number(limits) | ParameterKind::Amount(limits) => {
                numbers(limits).map(Value::Number).collect()
            }
            ParameterKind::Texture => vec![Value::Flag(true)],
            ParameterKind::Pair(limits) => numbers(limits).map(|number| Value::Pair([number; 2])).collect(),
            ParameterKind::Colour(limits) => {
                numbers(limits).map(|number| Value::Colour([number; 3])).collect()
            }
            ParameterKind::Vector(_) => [&vectors[..], &[Value::Vector(DVec3::ZERO)]].concat(),
            ParameterKind::NonZero(_) => vectors.to_vec(),
            ParameterKind::Direction(_) => vectors[..2].to_vec(),
            ParameterKind::Material => vec![Value::Material(0), Value::Material(1)],
            ParameterKind::Word(words) => (0..words.len().min(2)).map(Value::Word).collect(),
            ParameterKind::Words(_) => vec![Value::Words([0, 1])],
            ParameterKind::Flag => vec![Value::Flag(false), Value::Flag(true)],
            ParameterKind::Varying(_) => vec![Value::Varying(Varying::Colour([0.5; 3]))],
            ParameterKind::Integer(least, most) => [least, most].map(|x| Value::Number(x.into())).to_vec(),
            ParameterKind::Image => vec![Value::Image(ImageIndex(0))],
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
        checks_are_sound::<TextureKind>(&mut found);
        checks_are_sound::<Modifiers>(&mut found);
        for known in [
            ("plane", "distance"),
            ("quad", "v"),
            ("cylinder", "to"),
            ("box", "max"),
            ("image", "uv_set"),
            ("modifiers", "normal_scale"),
        ] {
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
        is_sound::<TextureKind>();
        is_sound::<Modifiers>();
    }
}
