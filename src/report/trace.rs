//! The `--trace` file: the frame on a time line, in the Trace Event format that Perfetto and `chrome://tracing` open.
//!
//! One process with a track per CPU thread, one with the GPU. GPU scopes are drawn as bars around their passes. With
//! calibrated clocks both share one time axis; without, the GPU track is moved so that its first pass starts with the
//! first CPU span, and the track's name says so.

use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use serde_json::{Map, Value, json};

use super::profile::PassRecord;
use super::write::{FileError, write_text};

const CPU_PROCESS: u32 = 1;
const GPU_PROCESS: u32 = 2;

/// A stretch of work on one CPU thread, nanoseconds since the time line's origin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CpuSpan {
    pub name: String,
    pub thread: String,
    pub start_ns: u64,
    pub end_ns: u64,
}

/// How the GPU's clock lies against the CPU's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// Both clocks read at the same moment, within `max_deviation_ns`.
    Calibrated { gpu_ns: u64, cpu_ns: u64, max_deviation_ns: u64 },
    /// The device offers no common reading.
    Uncalibrated,
}

/// Collects [`CpuSpan`]s from any thread.
#[derive(Debug)]
pub struct TimeLine {
    origin: Instant,
    spans: Mutex<Vec<CpuSpan>>,
}

impl Default for TimeLine {
    fn default() -> Self {
        Self { origin: Instant::now(), spans: Mutex::default() }
    }
}

impl TimeLine {
    /// Nanoseconds from the origin to `moment` (0 if it lies before).
    pub fn ns_at(&self, moment: Instant) -> u64 {
        u64::try_from(moment.saturating_duration_since(self.origin).as_nanos()).unwrap_or(u64::MAX)
    }

    /// Run `work` and keep when it ran.
    pub fn span<T>(&self, name: &str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        let end = Instant::now();
        let thread = std::thread::current().name().unwrap_or("unnamed").to_owned();
        let span = CpuSpan { name: name.to_owned(), thread, start_ns: self.ns_at(start), end_ns: self.ns_at(end) };
        // A thread that panicked while pushing leaves the list whole.
        self.spans.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(span);
        result
    }

    /// Lay a device's clock beside this time line: `read` gives (device nanoseconds, deviation in nanoseconds) for the
    /// moment it runs. The tightest of a few readings is taken; half its duration adds to the deviation.
    pub fn calibrate(&self, mut read: impl FnMut() -> Option<(u64, u64)>) -> Clock {
        const READINGS: usize = 8;
        let mut best = Clock::Uncalibrated;
        let mut best_deviation = u64::MAX;
        for _ in 0..READINGS {
            let before = self.ns_at(Instant::now());
            let Some((gpu_ns, deviation)) = read() else { continue };
            let duration = self.ns_at(Instant::now()).saturating_sub(before);
            let max_deviation_ns = deviation.saturating_add(duration.div_ceil(2));
            if max_deviation_ns < best_deviation {
                best_deviation = max_deviation_ns;
                best = Clock::Calibrated { gpu_ns, cpu_ns: before + duration / 2, max_deviation_ns };
            }
        }
        best
    }

    /// Everything collected so far.
    pub fn spans(&self) -> Vec<CpuSpan> {
        self.spans.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
    }
}

/// Write the trace, whole or not at all. `about` (device, scene, settings ...) is stored beside the events.
pub fn write(
    path: &Path,
    cpu: &[CpuSpan],
    gpu: &[PassRecord],
    clock: Clock,
    about: &Map<String, Value>,
) -> Result<(), FileError> {
    write_text(path, &(to_json(cpu, gpu, clock, about).to_string() + "\n"))
}

/// The trace as a JSON value.
pub fn to_json(cpu: &[CpuSpan], gpu: &[PassRecord], clock: Clock, about: &Map<String, Value>) -> Value {
    let offset_ns = gpu_offset(cpu, gpu, clock);
    let gpu_track = match clock {
        Clock::Calibrated { max_deviation_ns, .. } => format!("GPU (clock within {max_deviation_ns} ns of the CPU's)"),
        Clock::Uncalibrated => "GPU (clock not calibrated: moved to start with the CPU)".to_owned(),
    };
    let mut events =
        vec![name_event("process_name", CPU_PROCESS, 0, "CPU"), name_event("process_name", GPU_PROCESS, 0, &gpu_track)];

    let mut threads: Vec<&str> = Vec::new();
    for span in cpu {
        let thread = threads.iter().position(|name| *name == span.thread).unwrap_or_else(|| {
            threads.push(&span.thread);
            events.push(name_event("thread_name", CPU_PROCESS, threads.len() - 1, &span.thread));
            threads.len() - 1
        });
        let (start, end) = (i128::from(span.start_ns), i128::from(span.end_ns));
        events.push(complete_event(&span.name, CPU_PROCESS, thread, start, end, json!({})));
    }

    events.push(name_event("thread_name", GPU_PROCESS, 0, "queue"));
    for scope in scopes(gpu) {
        let (start, end) = (i128::from(scope.start_ns) + offset_ns, i128::from(scope.end_ns) + offset_ns);
        events.push(complete_event(scope.name, GPU_PROCESS, 0, start, end, json!({})));
    }
    for pass in gpu {
        let mut args = Map::new();
        args.insert("bytes read".to_owned(), pass.bytes_read.into());
        args.insert("bytes written".to_owned(), pass.bytes_written.into());
        args.insert("overlapped".to_owned(), pass.overlapped.into());
        args.extend(pass.counters.iter().map(|(name, count)| (name.clone(), (*count).into())));
        let (start, end) = (i128::from(pass.start_ns) + offset_ns, i128::from(pass.end_ns) + offset_ns);
        // Passes that share the GPU cannot be drawn as nested bars: a track of their own.
        events.push(complete_event(
            &pass.name,
            GPU_PROCESS,
            usize::from(pass.overlapped),
            start,
            end,
            Value::Object(args),
        ));
    }
    if gpu.iter().any(|pass| pass.overlapped) {
        events.push(name_event("thread_name", GPU_PROCESS, 1, "queue, overlapping passes"));
    }
    json!({ "traceEvents": events, "displayTimeUnit": "ms", "otherData": about })
}

/// What to add to a GPU time to have it on the CPU's axis.
fn gpu_offset(cpu: &[CpuSpan], gpu: &[PassRecord], clock: Clock) -> i128 {
    match clock {
        Clock::Calibrated { gpu_ns, cpu_ns, .. } => i128::from(cpu_ns) - i128::from(gpu_ns),
        Clock::Uncalibrated => {
            let first_cpu = cpu.iter().map(|span| span.start_ns).min().unwrap_or(0);
            let first_gpu = gpu.iter().map(|pass| pass.start_ns).min().unwrap_or(0);
            i128::from(first_cpu) - i128::from(first_gpu)
        }
    }
}

#[derive(Debug, PartialEq, Eq)]
struct Scope<'a> {
    name: &'a str,
    depth: usize,
    start_ns: u64,
    end_ns: u64,
}

/// Bars around runs of consecutive passes with the same scopes, outer ones first.
fn scopes(passes: &[PassRecord]) -> Vec<Scope<'_>> {
    let mut closed: Vec<Scope> = Vec::new();
    let mut open: Vec<Scope> = Vec::new();
    for pass in passes.iter().filter(|pass| !pass.overlapped) {
        let scopes = pass.path.strip_suffix(&pass.name).unwrap_or_default();
        let path: Vec<&str> = scopes.split('/').filter(|scope| !scope.is_empty()).collect();
        let shared = open.iter().zip(&path).take_while(|(scope, name)| scope.name == **name).count();
        closed.extend(open.drain(shared..));
        for scope in &mut open {
            scope.end_ns = scope.end_ns.max(pass.end_ns);
        }
        for (depth, name) in path.iter().enumerate().skip(shared) {
            open.push(Scope { name, depth, start_ns: pass.start_ns, end_ns: pass.end_ns });
        }
    }
    closed.append(&mut open);
    closed.sort_by_key(|scope| (scope.start_ns, scope.depth));
    closed
}

/// A bar. The format counts in microseconds.
fn complete_event(name: &str, process: u32, thread: usize, start_ns: i128, end_ns: i128, args: Value) -> Value {
    let microseconds = |ns: i128| ns as f64 / 1000.0;
    json!({
        "name": name, "ph": "X", "pid": process, "tid": thread,
        "ts": microseconds(start_ns), "dur": microseconds((end_ns - start_ns).max(0)), "args": args,
    })
}

fn name_event(kind: &str, process: u32, thread: usize, name: &str) -> Value {
    json!({ "name": kind, "ph": "M", "pid": process, "tid": thread, "args": { "name": name } })
}

#[cfg(test)]
mod tests {
    use super::super::profile::tests::record;
    use super::*;

    fn bars(trace: &Value, process: u32) -> Vec<(String, f64, f64)> {
        let events = trace["traceEvents"].as_array().unwrap();
        let bars = events.iter().filter(|event| event["ph"] == "X" && event["pid"] == process);
        bars.map(|event| {
            let number = |key: &str| event[key].as_f64().unwrap();
            (event["name"].as_str().unwrap().to_owned(), number("ts"), number("dur"))
        })
        .collect()
    }

    fn bar(name: &str, start: f64, duration: f64) -> (String, f64, f64) {
        (name.to_owned(), start, duration)
    }

    fn sample() -> (Vec<CpuSpan>, Vec<PassRecord>) {
        let span = CpuSpan { name: "load".into(), thread: "main".into(), start_ns: 2_000, end_ns: 5_000 };
        let passes = vec![
            record("frame/m/bounce 0", "gather/links", 1_000_000, 1_001_000),
            record("frame/m/bounce 1", "gather/links", 1_002_000, 1_003_000),
            record("frame", "tone-map", 1_004_000, 1_005_000),
        ];
        (vec![span], passes)
    }

    #[test]
    fn scopes_enclose_their_passes() {
        let (cpu, gpu) = sample();
        let clock = Clock::Calibrated { gpu_ns: 1_000_000, cpu_ns: 10_000, max_deviation_ns: 50 };
        let trace = to_json(&cpu, &gpu, clock, &Map::new());
        assert_eq!(bars(&trace, CPU_PROCESS), [bar("load", 2.0, 3.0)]);
        let expected = [
            bar("frame", 10.0, 5.0),
            bar("m", 10.0, 3.0),
            bar("bounce 0", 10.0, 1.0),
            bar("bounce 1", 12.0, 1.0),
            bar("gather/links", 10.0, 1.0),
            bar("gather/links", 12.0, 1.0),
            bar("tone-map", 14.0, 1.0),
        ];
        assert_eq!(bars(&trace, GPU_PROCESS), expected);
        assert!(trace.to_string().contains("within 50 ns"));
    }

    #[test]
    fn an_uncalibrated_gpu_starts_with_the_cpu_and_says_so() {
        let (cpu, gpu) = sample();
        let trace = to_json(&cpu, &gpu, Clock::Uncalibrated, &Map::new());
        assert_eq!(bars(&trace, GPU_PROCESS)[0], bar("frame", 2.0, 5.0));
        assert!(trace.to_string().contains("not calibrated"));
        assert_eq!(to_json(&[], &[], Clock::Uncalibrated, &Map::new())["displayTimeUnit"], "ms");
    }

    #[test]
    fn counters_become_arguments_and_overlapping_passes_a_track() {
        let mut pass = record("frame", "a", 0, 10);
        pass.counters = vec![("links made".into(), 12)];
        pass.overlapped = true;
        let trace = to_json(&[], &[pass], Clock::Uncalibrated, &Map::new());
        let events = trace["traceEvents"].as_array().unwrap();
        let event = events.iter().find(|event| event["name"] == "a").unwrap();
        assert_eq!((&event["args"]["links made"], &event["tid"]), (&json!(12), &json!(1)));
    }

    #[test]
    fn calibration_takes_the_tightest_reading_or_none() {
        let line = TimeLine::default();
        assert_eq!(line.calibrate(|| None), Clock::Uncalibrated);
        let mut reading = 0;
        let clock = line.calibrate(|| {
            reading += 1;
            if reading != 3 {
                std::thread::sleep(std::time::Duration::from_millis(2));
            }
            Some((reading, 5))
        });
        let Clock::Calibrated { gpu_ns, max_deviation_ns, .. } = clock else { panic!("{clock:?}") };
        assert_eq!(gpu_ns, 3);
        assert!((5..1_000_000).contains(&max_deviation_ns), "{max_deviation_ns}");
    }

    #[test]
    fn a_time_line_keeps_spans_of_every_thread() {
        let line = TimeLine::default();
        assert_eq!(line.span("outer", || line.span("inner", || 7)), 7);
        std::thread::scope(|scope| {
            std::thread::Builder::new().name("worker".into()).spawn_scoped(scope, || line.span("w", || ())).unwrap();
        });
        let spans = line.spans();
        let names: Vec<&str> = spans.iter().map(|span| span.name.as_str()).collect();
        assert_eq!(names, ["inner", "outer", "w"]);
        assert!(spans[1].start_ns <= spans[0].start_ns && spans[0].end_ns <= spans[1].end_ns);
        assert_eq!(spans[2].thread, "worker");
    }
}
