//! Limits on the size of a scene.

/// The maximum size in bytes of all XML files of a scene. A file that is included several times counts as often.
pub(super) const MOST_BYTES: u64 = 64 << 20;
/// The maximum number of elements in all XML files of a scene, counted in the same way.
pub(super) const MOST_ELEMENTS: usize = 1 << 20;
/// The maximum depth of nested elements, including those of included files and of objects that `ref` names.
pub(super) const MOST_NESTING: usize = 64;
/// The maximum depth of files that include each other.
pub(super) const MOST_INCLUDES: usize = 16;
/// The maximum number of folders in which files are searched for: the scene's, those of included files, and those of
/// `<path>`.
pub(super) const MOST_FOLDERS: usize = 64;
/// The maximum number of attributes of an element. The parser compares each to all others.
pub(super) const MOST_ATTRIBUTES: usize = 32;
/// The maximum length in bytes of an attribute, after the values of variables are inserted.
pub(super) const LONGEST_SUBSTITUTED: usize = 1 << 16;
/// The maximum growth in bytes of all attributes by values of variables, besides the size of the files.
pub(super) const MOST_GROWTH: u64 = 1 << 20;
/// The maximum number of entities.
pub(super) const MOST_ENTITIES: usize = 1 << 18;
/// The maximum size in bytes of a file with a spectrum.
pub(super) const LONGEST_SPECTRUM: u64 = 1 << 20;
/// The maximum size in bytes of all files with spectra, each counted once.
pub(super) const MOST_SPECTRA: u64 = 64 << 20;
/// The maximum size in bytes of all decompressed serialized meshes, and of meshes with normals that are computed in the
/// world.
pub(super) const MOST_UNPACKED: u64 = 4 << 30;
