//! Cameras. One that makes no sense is left out with a note: the picture can be taken from elsewhere.

use super::document::Document;
use super::error::Fault;
use super::json::Object;
use crate::scene::{Camera, Projection};

/// Reads one camera; `None` where it is unusable, which is noted.
pub fn read(document: &Document, object: &Object) -> Result<Option<Camera>, Fault> {
    let projection = document.tolerate("A camera", read_projection(object))?;
    Ok(projection.map(|projection| Camera { name: object.name(), projection }))
}

fn read_projection(camera: &Object) -> Result<Projection, Fault> {
    let part = |key| camera.require(key, camera.object(key)?);
    let number = |part: &Object, key| part.require(key, part.number(key)?);
    match camera.require("type", camera.text("type")?)? {
        "perspective" => {
            let lens = part("perspective")?;
            let (fov_y, near, far) = (number(&lens, "yfov")?, number(&lens, "znear")?, lens.number("zfar")?);
            check(&lens, "yfov", fov_y > 0.0 && fov_y < std::f32::consts::PI, "must be between 0 and pi")?;
            check(&lens, "znear", near > 0.0, "must be positive")?;
            check(&lens, "zfar", far.is_none_or(|far| far > near), "must be beyond znear")?;
            Ok(Projection::Perspective { fov_y, near, far })
        }
        "orthographic" => {
            let lens = part("orthographic")?;
            let (half_width, half_height) = (number(&lens, "xmag")?, number(&lens, "ymag")?);
            let (near, far) = (number(&lens, "znear")?, number(&lens, "zfar")?);
            check(&lens, "xmag", half_width > 0.0, "must be positive")?;
            check(&lens, "ymag", half_height > 0.0, "must be positive")?;
            check(&lens, "znear", near >= 0.0, "must not be negative")?;
            check(&lens, "zfar", far > near, "must be beyond znear")?;
            Ok(Projection::Orthographic { half_width, half_height, near, far })
        }
        _ => Err(camera.invalid("type", "must be perspective or orthographic")),
    }
}

fn check(object: &Object, key: &str, holds: bool, rule: &str) -> Result<(), Fault> {
    if holds { Ok(()) } else { Err(object.invalid(key, rule)) }
}
