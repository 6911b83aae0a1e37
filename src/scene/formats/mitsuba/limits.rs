//! What a file may ask for at most.

/// The most bytes of all XML files of a scene, each counted as often as it is included.
pub(super) const MOST_BYTES: u64 = 64 << 20;
/// The most elements of all XML files of a scene, counted likewise.
pub(super) const MOST_ELEMENTS: usize = 1 << 20;
/// The most elements inside each other, those of files that are included and of what is named by `ref` among them.
pub(super) const MOST_NESTING: usize = 64;
/// The most files that include each other.
pub(super) const MOST_INCLUDES: usize = 16;
/// The most folders in which files are looked for: the scene's, those of files that are included, and those of `<path>`.
pub(super) const MOST_FOLDERS: usize = 64;
/// The most attributes of an element: the parser compares each to all others.
pub(super) const MOST_ATTRIBUTES: usize = 32;
/// The most bytes of an attribute in which variables stand, after their values were put in.
pub(super) const LONGEST_SUBSTITUTED: usize = 1 << 16;
/// The most bytes by which all attributes grow when values are put in place of variables, besides the size of the files.
pub(super) const MOST_GROWTH: u64 = 1 << 20;
/// The most entities.
pub(super) const MOST_ENTITIES: usize = 1 << 18;
/// The most bytes of a file with a spectrum.
pub(super) const LONGEST_SPECTRUM: u64 = 1 << 20;
/// The most bytes of all files with spectra, each of which counts once.
pub(super) const MOST_SPECTRA: u64 = 64 << 20;
/// The most bytes of all serialized meshes, unpacked, and of meshes whose normals are those of where they stand.
pub(super) const MOST_UNPACKED: u64 = 4 << 30;
