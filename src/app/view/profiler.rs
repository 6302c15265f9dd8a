//! What the passes of the last frames cost, as a window over the picture.

use std::collections::{BTreeMap, VecDeque};

use egui::{CollapsingHeader, Color32, Pos2, RichText, ScrollArea, Sense, Shape, Stroke, Ui, Vec2};

use crate::app::measure;
use crate::gpu::{MemoryUse, PassRecord};
use crate::report::profile::{Pass, summarise};

/// Frames over which times are told.
const WINDOW: usize = 64;
/// Records kept of one frame, so that endless work does not fill the memory.
const MOST_RECORDS: usize = 100_000;
const GRAPH_HEIGHT: f32 = 60.0;

/// Times of the frames rendered last.
#[derive(Default)]
pub struct Profiler {
    frames: VecDeque<FrameTimes>,
    /// Of the frame being rendered.
    pending: Vec<PassRecord>,
    /// Whole frames, as the device recorded them, where they are asked for in the end.
    kept: Option<VecDeque<Vec<PassRecord>>>,
    /// Of the window's own passes, ms.
    window_ms: f64,
    /// What a copy moves, bytes a millisecond; `None` until it is measured.
    pub bandwidth: Option<f64>,
}

struct FrameTimes {
    passes: Vec<Pass>,
    /// From request to film.
    wall_ms: f64,
    gpu_ms: f64,
}

/// A scope or a pass.
#[derive(Default)]
struct Node<'p> {
    ms: f64,
    children: Vec<(&'p str, Node<'p>)>,
    pass: Option<&'p Pass>,
}

impl Profiler {
    /// `keeps_records`: for [`Self::kept`].
    pub fn new(keeps_records: bool) -> Self {
        Self { kept: keeps_records.then(VecDeque::new), ..Self::default() }
    }

    /// The last frames: how many, and their records.
    pub fn kept(&self) -> (u32, Vec<PassRecord>) {
        let frames = self.kept.iter().flatten();
        (frames.clone().count() as u32, frames.flatten().cloned().collect())
    }

    /// Takes what ran since the last call; the window's own passes are apart.
    pub fn take(&mut self, records: Vec<PassRecord>) {
        let (own, others): (Vec<_>, Vec<_>) =
            records.into_iter().partition(|record| record.path.starts_with("window/"));
        if !own.is_empty() {
            self.window_ms = own.iter().map(milliseconds).sum();
        }
        let room = MOST_RECORDS.saturating_sub(self.pending.len());
        self.pending.extend(others.into_iter().take(room));
    }

    /// A frame was finished after so many milliseconds.
    pub fn finish_frame(&mut self, wall_ms: f64) {
        let records = std::mem::take(&mut self.pending);
        if let Some(kept) = &mut self.kept {
            kept.push_back(records.clone());
            if kept.len() > WINDOW {
                kept.pop_front();
            }
        }
        let passes = summarise(&measure::pass_records(records));
        let gpu_ms = passes.iter().map(|pass| pass.ms.total).sum();
        self.frames.push_back(FrameTimes { passes, wall_ms, gpu_ms });
        while self.frames.len() > WINDOW {
            self.frames.pop_front();
        }
    }

    pub fn show(&self, ui: &mut Ui, memory: &BTreeMap<String, MemoryUse>) {
        let Some(last) = self.frames.back() else {
            ui.label("no frame yet");
            return;
        };
        let share = match self.bandwidth {
            Some(bandwidth) => format!("a copy moves {:.1} GB/s", bandwidth * 1e-6),
            None => "measuring what a copy moves".to_owned(),
        };
        ui.label(format!(
            "frame {:.2} ms, passes {:.2} ms, window {:.2} ms; {share}",
            last.wall_ms, last.gpu_ms, self.window_ms
        ));
        self.graph(ui);
        ScrollArea::both().max_height(360.0).auto_shrink(false).show(ui, |ui| {
            ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
            self.show_nodes(ui, &tree(&last.passes));
            CollapsingHeader::new("memory by owner").show(ui, |ui| {
                for (owner, memory) in memory.iter().filter(|(_, memory)| memory.current_bytes > 0) {
                    let [now, peak] = [memory.current_bytes, memory.peak_bytes].map(megabytes);
                    ui.monospace(format!("{owner:24} {now:9.2} MB, at most {peak:9.2}"));
                }
                let sum = memory.values().map(|memory| memory.current_bytes).sum();
                ui.monospace(format!("{:24} {:9.2} MB", "sum", megabytes(sum)));
            });
        });
        ui.weak("ms of the last frames: min, median, max; ~ ran beside another pass; % of what a copy moves");
    }

    fn show_nodes(&self, ui: &mut Ui, node: &Node<'_>) {
        for (name, child) in &node.children {
            match child.pass {
                Some(pass) => {
                    ui.label(RichText::new(self.line(name, pass)).monospace()).on_hover_text(counters(pass));
                }
                None => {
                    CollapsingHeader::new(format!("{name}  {:.3} ms", child.ms))
                        .id_salt(name)
                        .default_open(true)
                        .show(ui, |ui| self.show_nodes(ui, child));
                }
            }
        }
    }

    fn line(&self, name: &str, pass: &Pass) -> String {
        let totals = |frame: &FrameTimes| frame.passes.iter().find(|p| p.path == pass.path).map(|p| p.ms.total);
        let mut times: Vec<f64> = self.frames.iter().filter_map(totals).collect();
        times.sort_by(f64::total_cmp);
        let at = |place: usize| times.get(place).copied().unwrap_or(pass.ms.total);
        let (min, median, max) = (at(0), at(times.len() / 2), at(times.len().saturating_sub(1)));
        let bytes = pass.bytes_read + pass.bytes_written;
        let share = match self.bandwidth {
            Some(bandwidth) if pass.ms.total > 0.0 => {
                format!("{:5.1} %", 100.0 * bytes as f64 / pass.ms.total / bandwidth)
            }
            _ => String::new(),
        };
        let mark = if pass.overlapped { '~' } else { ' ' };
        format!("{name:30} {mark}{min:9.3} {median:9.3} {max:9.3} {:9.2} MB {share}", megabytes(bytes))
    }

    /// Frame and passes over the last frames.
    fn graph(&self, ui: &mut Ui) {
        let (response, painter) = ui.allocate_painter(Vec2::new(ui.available_width(), GRAPH_HEIGHT), Sense::hover());
        let rect = response.rect;
        painter.rect_filled(rect, 2.0, Color32::from_black_alpha(100));
        let most = self.frames.iter().map(|frame| frame.wall_ms.max(frame.gpu_ms)).fold(1e-3, f64::max);
        let point = |i: usize, ms: f64| {
            let x = rect.left() + rect.width() * (i as f32 + 0.5) / WINDOW as f32;
            Pos2::new(x, rect.bottom() - rect.height() * (ms / most) as f32)
        };
        let frames = || self.frames.iter().enumerate();
        let wall = frames().map(|(i, frame)| point(i, frame.wall_ms)).collect();
        let passes = frames().map(|(i, frame)| point(i, frame.gpu_ms)).collect();
        painter.add(Shape::line(wall, Stroke::new(1.5, Color32::LIGHT_BLUE)));
        painter.add(Shape::line(passes, Stroke::new(1.5, Color32::ORANGE)));
        painter.text(
            rect.left_top(),
            egui::Align2::LEFT_TOP,
            format!("{most:.1} ms; blue frame, orange passes"),
            egui::FontId::proportional(11.0),
            Color32::GRAY,
        );
    }
}

fn milliseconds(record: &PassRecord) -> f64 {
    record.end_ns.saturating_sub(record.start_ns) as f64 * 1e-6
}

fn megabytes(bytes: u64) -> f64 {
    bytes as f64 * 1e-6
}

fn counters(pass: &Pass) -> String {
    let counters: Vec<String> = pass.counters.iter().map(|(name, count)| format!("{name}: {count}")).collect();
    format!("{}\n{} calls\n{}", pass.path, pass.calls, counters.join("\n"))
}

/// Scopes in the order of their first pass. A pass's own name has a slash in it, so it is one leaf.
fn tree(passes: &[Pass]) -> Node<'_> {
    let mut root = Node::default();
    for pass in passes {
        let scopes = pass.path.strip_suffix(pass.name.as_str()).unwrap_or_default().trim_end_matches('/');
        let mut node = &mut root;
        for scope in scopes.split('/').filter(|scope| !scope.is_empty()) {
            node = child(node, scope);
            node.ms += pass.ms.total;
        }
        let leaf = child(node, &pass.name);
        leaf.ms += pass.ms.total;
        leaf.pass = Some(pass);
    }
    root
}

fn child<'n, 'p>(node: &'n mut Node<'p>, name: &'p str) -> &'n mut Node<'p> {
    let at = node.children.iter().position(|(other, _)| *other == name).unwrap_or(node.children.len());
    if at == node.children.len() {
        node.children.push((name, Node::default()));
    }
    &mut node.children[at].1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(path: &str, name: &'static str, ms: u64) -> PassRecord {
        PassRecord {
            path: path.into(),
            name,
            start_ns: 0,
            end_ns: ms * 1_000_000,
            bytes_read: 0,
            bytes_written: 0,
            counters: Vec::new(),
            overlapped: false,
        }
    }

    #[test]
    fn scopes_sum_their_passes_and_the_window_stays_apart() {
        let mut profiler = Profiler::new(true);
        profiler.take(vec![
            record("frame/a/gather/links", "gather/links", 2),
            record("window/display/interface", "display/interface", 7),
            record("frame/a/elements/add", "elements/add", 3),
        ]);
        profiler.take(vec![record("frame/b/gather/links", "gather/links", 4)]);
        profiler.finish_frame(12.0);
        let frame = profiler.frames.back().unwrap();
        assert_eq!((frame.gpu_ms, frame.wall_ms), (9.0, 12.0));
        let (frames, records) = profiler.kept();
        assert_eq!((frames, records.len()), (1, 3), "the window's own passes are not among them");
        let root = tree(&frame.passes);
        let (name, top) = &root.children[0];
        assert_eq!((*name, top.ms, top.children.len()), ("frame", 9.0, 2));
        assert_eq!((top.children[0].0, top.children[0].1.ms, top.children[1].1.ms), ("a", 5.0, 4.0));
        assert!(top.children[0].1.children.iter().all(|(_, leaf)| leaf.pass.is_some()));
    }

    #[test]
    fn only_the_last_frames_stay() {
        let mut profiler = Profiler::new(true);
        for _ in 0..3 * WINDOW {
            profiler.take(vec![record("frame/x/y", "x/y", 1); 3]);
            profiler.finish_frame(1.0);
        }
        assert_eq!((profiler.frames.len(), profiler.pending.len()), (WINDOW, 0));
        assert_eq!(profiler.kept().0, WINDOW as u32);
    }
}
