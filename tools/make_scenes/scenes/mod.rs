//! What each built-in scene is made of, one file a scene or small family.

mod church;
mod church_parts;
mod cornell;
mod dancer;
mod document;
mod figure;
mod kit;
mod maze;
mod office;
mod office_furniture;
mod plates;
mod rooms;
mod tea_room;
mod tea_things;

use document::Document;

type Maker = fn() -> Document;

/// File stem and maker of every scene that is kept as a file.
pub const ALL: [(&str, Maker); 11] = [
    ("cornell-box", cornell::with_boxes),
    ("cornell-empty", cornell::empty),
    ("furnace", rooms::furnace),
    ("parallel-plates", plates::parallel),
    ("perpendicular-plates", plates::perpendicular),
    ("two-rooms", rooms::two_rooms),
    ("maze", maze::maze),
    ("office", office::office),
    ("tea-room", tea_room::tea_room),
    ("church", church::church),
    ("dancer", dancer::dancer),
];
