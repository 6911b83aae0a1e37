//! Integrators, and the largest number of bounces.

use super::builder::Builder;
use super::object::{Object, Tag};
use super::report::Read;
use crate::scene::description::{Integrator, MOST_BOUNCES, UNLIMITED};

impl Builder<'_, '_> {
    /// Reads the integrator of the scene. The default is the path tracer.
    pub(super) fn integrator(&mut self) -> Read<()> {
        self.scene.render.integrator = Integrator::Path;
        self.scene.render.max_depth = UNLIMITED;
        let scene = self.object(0);
        match self.child(scene, Tag::Integrator) {
            Some(object) => self.depth_of(object),
            None => Ok(()),
        }
    }

    fn depth_of(&mut self, object: &Object) -> Read<()> {
        self.places.render = object.place;
        object.ignore(&["block_size", "samples_per_pass", "timeout", "rr_depth"]);
        if object.flag("hide_emitters", false, self.reports)? {
            self.reports.lacks(object.place, "hide_emitters of an integrator", "emitters are visible");
        }
        match object.plugin.as_str() {
            "path" => self.bounces(object, -1),
            // Light that arrives after one bounce.
            "direct" => {
                object.ignore(&["shading_samples", "emitter_samples", "bsdf_samples"]);
                self.scene.render.max_depth = 1;
                Ok(())
            }
            // Their additional channels are layers in stride.
            "moment" | "aov" => {
                object.ignore(&["aovs"]);
                if object.plugin == "aov" {
                    self.reports.lacks(object.place, object.what(), "use --layers for further layers");
                }
                match self.child(object, Tag::Integrator) {
                    Some(inner) => self.depth_of(inner),
                    // Such an `aov` has layers only, and is rendered with colours.
                    None if object.plugin == "aov" => Ok(()),
                    None => {
                        let message = format!("{} has no integrator in it", object.what());
                        let help = || Some("add <integrator type=\"path\"/> to it".into());
                        Err(self.reports.error_with(object.place, message, help))
                    }
                }
            }
            // Other methods with the same image. Media are reported separately.
            "ptracer" | "volpath" | "volpathmis" | "prb" | "prb_basic" => self.bounces(object, -1),
            // Integrators around another one transform its light: `stokes` has its polarisation.
            _ if self.document.children(object, Tag::Integrator).len() == 1 => {
                self.reports.lacks(object.place, object.what(), "the integrator in it is used");
                object.ignore_all();
                match self.child(object, Tag::Integrator) {
                    Some(inner) => self.depth_of(inner),
                    None => Ok(()),
                }
            }
            _ => {
                self.reports.lacks(object.place, object.what(), "a path tracer is used instead");
                let bounces = self.bounces(object, -1);
                object.ignore_all();
                bounces
            }
        }
    }

    /// Sets the largest number of bounces. Mitsuba counts the segments of a path, of which there is one more.
    fn bounces(&mut self, object: &Object, default: i64) -> Read<()> {
        let depth = object.whole("max_depth", default, self.reports)?;
        self.scene.render.max_depth = match depth {
            -1 => UNLIMITED,
            0 => {
                let what = "max_depth 0 (a black image)";
                self.reports.lacks(object.place, what, "emitters are visible");
                0
            }
            1.. => match u32::try_from(depth - 1).ok().filter(|bounces| *bounces <= MOST_BOUNCES) {
                Some(bounces) => bounces,
                None => {
                    let what = format!("max_depth above {}", MOST_BOUNCES + 1);
                    self.reports.lacks(object.place, what, "paths have no limit");
                    UNLIMITED
                }
            },
            _ => {
                let message = format!("max_depth must be −1, or 0 and above, not {depth}");
                return Err(self.reports.error(object.place, message));
            }
        };
        Ok(())
    }
}
