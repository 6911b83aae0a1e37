//! Reconstruction filters.
//!
//! A filter without negative lobes is a density: drawing samples from it and giving all the same weight
//! makes their mean the filtered picture (report §5.2.5).

use crate::sampling::warp::FilmOffset;
use crate::scene::Filter;

/// How samples must be spread around a pixel's centre for their mean to be filtered.
pub fn film_offset(filter: Filter) -> FilmOffset {
    match filter {
        Filter::None => FilmOffset::Centre,
        Filter::Box { radius } => FilmOffset::Uniform(radius as f32),
        Filter::Tent { radius } => FilmOffset::Tent(radius as f32),
    }
}
