//! Tables whose keys are declared by a shape, texture, material or light.

use ::toml::de::DeValue;
use serde_json::{Value as Json, json};

use super::form::{Value, ValueForm};
use super::report::{Diagnostics, Placed, Read};
use super::table::{self, AnyKey, Fields, Key};
use super::value::{Colour, Direction, Flag, Integer, NonZero, OneWord, Pair, Vector, Word, wrong_type};
use super::varying::{GreyOr, TwoWords};
use crate::parameter::{self, Absence, Declaration, Family, ImageIndex, Parameter, ParameterKind, Varying};
use crate::scene::description::Textured;

/// The value of a parameter in a file.
pub(super) enum Given {
    Value(parameter::Value),
    /// The name of a material.
    Material(String),
    /// The name of a texture.
    Texture(String),
}

/// The target of a reference.
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

impl ValueForm for Slot {
    type Output = Given;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Read<Given> {
        use parameter::Value;
        // A number in quotes is a mistake.
        if let DeValue::String(word) = value.get_ref()
            && self.takes_names()
            && (self.kind == ParameterKind::Texture || word.trim().parse::<f64>().is_err())
        {
            return Word.read(key, value, diagnostics).map(Given::Texture);
        }
        let value = match self.kind {
            ParameterKind::Number(number) | ParameterKind::Amount(number) => {
                Value::Number(number.read(key, value, diagnostics)?)
            }
            ParameterKind::Texture => {
                return Err(wrong_type(key, "the name of a texture", value, diagnostics));
            }
            ParameterKind::Pair(each) => Value::Pair(Pair(each).read(key, value, diagnostics)?),
            ParameterKind::Colour(each) => Value::Colour(Colour(each).read(key, value, diagnostics)?),
            ParameterKind::Vector(each) => Value::Vector(Vector(each).read(key, value, diagnostics)?),
            ParameterKind::NonZero(each) => {
                Value::Vector(NonZero(Vector(each)).read(key, value, diagnostics)?)
            }
            ParameterKind::Direction(each) => {
                Value::Vector(Direction(NonZero(Vector(each))).read(key, value, diagnostics)?)
            }
            ParameterKind::Material => return Word.read(key, value, diagnostics).map(Given::Material),
            ParameterKind::Varying(each) => {
                Value::Varying(Varying::Colour(GreyOr(each).read(key, value, diagnostics)?))
            }
            ParameterKind::Integer(least, most) => {
                Value::Number(Integer { least, most }.read(key, value, diagnostics)?.into())
            }
            ParameterKind::Flag => Value::Flag(Flag.read(key, value, diagnostics)?),
            ParameterKind::Word(words) => Value::Word(OneWord(words).read(key, value, diagnostics)?),
            ParameterKind::Words(words) => Value::Words(TwoWords(words).read(key, value, diagnostics)?),
            ParameterKind::Image => {
                let name = Word.read(key, value, diagnostics)?;
                let at = value.span().start;
                Value::Image(ImageIndex(diagnostics.image(&Placed { at, value: name })?))
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

/// Whether the declaration's numbers and colours may be textures, in a family that allows them. Materials that only
/// combine others do not.
fn takes_textures(declaration: &Declaration, family_does: bool) -> bool {
    family_does && !declaration.parameters.iter().any(|parameter| parameter.kind == ParameterKind::Material)
}

/// The keys of a declared table.
pub(super) fn names(declaration: &'static Declaration) -> impl Iterator<Item = &'static str> + Clone {
    declaration.parameters.iter().map(|parameter| parameter.name)
}

/// The schema of a declared table, in a family whose numbers and colours may be textures; further keys may be added.
/// `common` declares the parameters that every member of the family shares.
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

/// The values of a declared table, with unresolved names of materials and textures. Values and names are resolved
/// separately, so that an error in one does not hide an error in the other.
pub(super) struct Values {
    /// The index of the declaration in its family.
    place: usize,
    pub(super) declaration: &'static Declaration,
    /// Each value with its byte offset.
    given: Vec<(usize, Read<Given>)>,
    /// The parameters shared by the family.
    pub(super) common: Option<Box<Values>>,
}

impl Values {
    /// Reads a table by a declaration of its family, whose numbers and colours may be textures.
    pub(super) fn read(
        place: usize,
        declaration: &'static Declaration,
        textured: bool,
        fields: &Fields<'_, '_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Values {
        let textured = takes_textures(declaration, textured);
        let read = |parameter| {
            let key = key(parameter, textured);
            let given = match parameter.absence {
                Absence::Fine => fields.get_if_there(&key, diagnostics).map(|given| match given {
                    Some(given) => given,
                    None => Given::Value(parameter::Value::Absent),
                }),
                _ => fields.get(&key, diagnostics),
            };
            (fields.place_of(&key), given)
        };
        Values { place, declaration, given: declaration.parameters.iter().map(read).collect(), common: None }
    }

    /// Builds the item, and returns its textured parameters. `find` resolves names to indices.
    pub(super) fn build<F: Family>(
        &self,
        mut find: impl FnMut(Wanted, &Placed<String>, &mut Diagnostics<'_>) -> Read<usize>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Read<(F, Vec<Textured>)> {
        let mut outcome = Ok(());
        let mut values = Vec::with_capacity(self.given.len());
        let mut textures = Vec::new();
        for ((at, given), parameter) in self.given.iter().zip(self.declaration.parameters) {
            let mut index = |wanted, name: &String, diagnostics: &mut Diagnostics<'_>| {
                find(wanted, &Placed { at: *at, value: name.clone() }, diagnostics)
            };
            let value = match given {
                Ok(Given::Value(value)) => Ok(*value),
                Ok(Given::Material(name)) => {
                    index(Wanted::Material, name, diagnostics).map(parameter::Value::Material)
                }
                Ok(Given::Texture(name)) => index(Wanted::Texture, name, diagnostics).map(|texture| {
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
            // Textured values were unknown to the checks, which found no problem.
            for (value, parameter) in values.iter_mut().zip(self.declaration.parameters) {
                if textures.iter().any(|textured| textured.parameter == parameter.name) {
                    *value = parameter.kind.stand_in().unwrap_or(*value);
                }
            }
            built = F::build(self.place, &values, &mut Vec::new());
        }
        let built = built.map_err(|problem| {
            let at = self.place_of(problem.parameter);
            diagnostics.error_with(at, problem.message.clone(), |_| problem.help.clone())
        });
        for warning in warnings {
            let help = warning.help.as_deref().unwrap_or_default();
            diagnostics.warn(Some(self.place_of(warning.parameter)), warning.message.clone(), help);
        }
        outcome.and(built).map(|built| (built, textures))
    }

    /// The position of a parameter's value.
    pub(super) fn place_of(&self, parameter: &str) -> usize {
        let common = self.common.as_deref();
        let all = [Some(self), common].into_iter().flatten();
        let mut places = all.flat_map(|values| names(values.declaration).zip(&values.given));
        let named = places.find(|(name, _)| *name == parameter);
        let (_, (at, _)) =
            named.unwrap_or_else(|| unreachable!("{} has no {parameter}", self.declaration.what));
        *at
    }

    /// The same for an item without references.
    pub(super) fn build_alone<F: Family>(&self, diagnostics: &mut Diagnostics<'_>) -> Read<F> {
        let none = |_, name: &Placed<String>, diagnostics: &mut Diagnostics<'_>| {
            Err(diagnostics.error(name.at, "only materials name materials"))
        };
        self.build(none, diagnostics).map(|(built, _)| built)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::{Light, MaterialKind, Modifiers, Shape, SphereParameters, TextureKind};
    use glam::DVec3;
    use std::collections::HashSet;

    /// For a family: fields have the types of their kinds, and defaults can be read.
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
                let mut diagnostics = Diagnostics::alone(default);
                let slot = Slot { kind: parameter.kind, textured: true };
                let read = slot.read(parameter.name, &value, &mut diagnostics).ok();
                let Some(Given::Value(read)) = read else { panic!("{default} of {}", parameter.name) };
                assert!(parameter.uncounted.is_none_or(|value| value == read), "{default}");
            }
        }
        let mut names: Vec<_> = F::DECLARATIONS.iter().map(|declaration| declaration.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), F::DECLARATIONS.len());
    }

    /// Some values of a kind, some of which conflict with others.
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

    /// The parameters that errors and warnings name.
    fn named<F: Family>(place: usize, values: &[parameter::Value]) -> Vec<&'static str> {
        let mut warnings = Vec::new();
        let problem = F::build(place, values, &mut warnings).err();
        problem.into_iter().chain(warnings).map(|problem| problem.parameter).collect()
    }

    /// For a family: checks report only existing parameters, and no problem depends on an unknown value. A check
    /// reports the first of several errors, so that without that value it may report another. Adds the declarations and
    /// parameters with reported problems.
    fn checks_are_sound<F: Family>(found: &mut HashSet<(&'static str, &'static str)>) {
        for (place, declaration) in F::DECLARATIONS.iter().enumerate() {
            let mut combinations = vec![Vec::new()];
            for parameter in declaration.parameters {
                let mut examples = examples(parameter.kind);
                if parameter.absence == Absence::Fine {
                    // Not all combinations, of which there may be many.
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
                    let reported = named::<F>(place, &unread);
                    assert!(
                        reported.iter().all(|reported| problems.contains(reported) || is_wrong),
                        "{reported:?} of {}, without {}: {values:?}",
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
