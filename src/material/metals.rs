//! The indices of refraction of metals by name.
//!
//! They are derived from the database of refractiveindex.info
//! (<https://github.com/polyanskiy/refractiveindex.info-database> at ff11b58, CC0 1.0); each line cites the source of
//! its data. `benches/metals.py` generates these lines. The number of a channel is the mean of the measured spectrum
//! from 380 nm to 780 nm. Its weights are those by which a reflectance spectrum under CIE illuminant D65 contributes to
//! that channel of linear Rec. 709 (CIE 1931, 2°). The resulting reflectances match those of the spectra under D65
//! within 0.02, except for red of gold, which is out of gamut (1.04) and becomes 0.98.

/// A metal's index of refraction η + i·k: red, green, blue.
pub(super) struct Index {
    pub(super) eta: [f64; 3],
    pub(super) k: [f64; 3],
}

macro_rules! metals {
    ($($name:literal: $eta:expr, $k:expr;)*) => {
        /// Their names.
        pub(super) const NAMES: &[&str] = &[$($name),*];

        /// Their indices, in the order of the names.
        pub(super) const INDICES: &[Index] = &[$(Index { eta: $eta, k: $k }),*];
    };
}

metals! {
    // Rakić 1995.
    "aluminium": [1.481, 0.982, 0.598], [7.6512, 6.5491, 5.3468];
    // Rakić et al. 1998, Brendel–Bormann.
    "beryllium": [3.4213, 3.3034, 3.0555], [3.1832, 3.1313, 3.1251];
    // Querry 1985, Cu70Zn30.
    "brass": [0.4184, 0.52, 1.123], [3.6678, 2.6807, 1.771];
    // Johnson and Christy 1974.
    "chromium": [3.251, 3.1072, 2.2791], [3.2886, 3.3375, 3.1243];
    // Johnson and Christy 1974.
    "cobalt": [2.2502, 2.0327, 1.7093], [4.218, 3.7908, 3.2328];
    // Johnson and Christy 1972.
    "copper": [0.1733, 1.0436, 1.29], [3.2823, 2.5993, 2.3667];
    // Johnson and Christy 1972.
    "gold": [0.0584, 0.5003, 1.4591], [3.6131, 2.3238, 1.8186];
    // Johnson and Christy 1974.
    "iron": [2.9242, 2.9171, 2.5453], [3.0762, 2.9371, 2.7499];
    // Mathewson and Myers 1971.
    "lead": [2.6149, 2.5514, 2.0617], [4.168, 4.1864, 4.1764];
    // Johnson and Christy 1974.
    "manganese": [2.5656, 2.3787, 2.0921], [3.6168, 3.3073, 2.9432];
    // Inagaki et al. 1981.
    "mercury": [2.0281, 1.5153, 1.0161], [5.3036, 4.6038, 3.7909];
    // Johnson and Christy 1974.
    "nickel": [2.0223, 1.9011, 1.7243], [4.1728, 3.5644, 2.8855];
    // Weaver et al. 1973.
    "niobium": [2.9108, 2.9096, 2.6207], [2.8303, 2.8864, 2.8119];
    // Johnson and Christy 1974.
    "palladium": [1.7878, 1.6196, 1.3921], [4.345, 3.8073, 3.2047];
    // Rakić et al. 1998, Brendel–Bormann.
    "platinum": [2.3444, 2.0658, 1.8222], [4.2333, 3.6753, 3.0838];
    // Weaver et al. 1977.
    "rhodium": [2.1596, 1.96, 1.7226], [5.6804, 4.9554, 4.3901];
    // Johnson and Christy 1972.
    "silver": [0.0555, 0.0547, 0.0429], [4.365, 3.5294, 2.5675];
    // Johnson and Christy 1974.
    "titanium": [2.737, 2.5072, 2.2363], [3.8281, 3.3972, 3.0098];
    // Weaver et al. 1975.
    "tungsten": [3.6345, 3.4936, 3.3123], [2.9227, 2.7469, 2.5044];
    // Johnson and Christy 1974.
    "vanadium": [3.4761, 3.9586, 3.6166], [2.9725, 3.0825, 3.4721];
}
