//! Two bench files, subject by subject: what became slower, and what the machine itself had to do with it.

use std::io::Write;

use crate::app::AppError;
use crate::report::bench_file::{BenchFile, Subject, Yardsticks};
use crate::report::statistics::{Shift, Verdict, unpaired};

/// One line of the comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    pub what: String,
    pub shift: Shift,
    /// After what the machine's own change explains.
    pub verdict: Verdict,
}

/// The frame of every subject that both files have, and its passes that changed. Nothing in common is an error.
pub fn changes(old: &BenchFile, new: &BenchFile) -> Result<Vec<Change>, AppError> {
    let mut changes = Vec::new();
    for subject in &new.subjects {
        let Some(before) = old.subjects.iter().find(|before| is_same(before, subject)) else { continue };
        let machine = machine_shift(old.yardsticks.get(before.device), new.yardsticks.get(subject.device));
        let name = format!("{} {} {}", subject.scene, subject.method, subject.variation).trim_end().to_owned();
        let Some(shift) = unpaired(&before.frame.values, &subject.frame.values) else { continue };
        let verdict = beyond(shift, machine);
        changes.push(Change { what: name.clone(), shift, verdict });
        for pass in &subject.passes {
            let Some(earlier) = before.passes.iter().find(|earlier| earlier.path == pass.path) else { continue };
            let positive = |values: &[f64]| values.iter().map(|ms| ms.max(1e-6)).collect::<Vec<f64>>();
            let Some(shift) = unpaired(&positive(&earlier.times.values), &positive(&pass.times.values)) else {
                continue;
            };
            let verdict = beyond(shift, machine);
            if verdict != Verdict::NotShown {
                changes.push(Change { what: format!("{name}: {}", pass.path), shift, verdict });
            }
        }
    }
    if changes.is_empty() {
        return Err(AppError::failed(
            "the two files have no subject in common (same scene, scene files, method and settings); \
             repeat the command that made the old one",
        ));
    }
    Ok(changes)
}

/// Same scene, down to its files, and same settings.
fn is_same(a: &Subject, b: &Subject) -> bool {
    (&a.scene, &a.scene_hash, &a.method, &a.settings) == (&b.scene, &b.scene_hash, &b.method, &b.settings)
}

/// How much longer the yardsticks took, from the least to the most affected: the interval that holds all of theirs.
fn machine_shift(old: Option<&Yardsticks>, new: Option<&Yardsticks>) -> [f64; 2] {
    let (Some(old), Some(new)) = (old, new) else { return [1.0, 1.0] };
    let pairs =
        [(&old.copy_ms, &new.copy_ms), (&old.multiply_add_ms, &new.multiply_add_ms), (&old.cpu_ms, &new.cpu_ms)];
    let shifts = pairs.iter().filter_map(|(old, new)| unpaired(old, new));
    shifts.fold([1.0f64, 1.0f64], |[low, high], shift| [low.min(shift.low), high.max(shift.high)])
}

/// Slower or faster only beyond what the machine itself became.
fn beyond(shift: Shift, [slowest, fastest]: [f64; 2]) -> Verdict {
    if shift.low > fastest {
        Verdict::Slower
    } else if shift.high < slowest {
        Verdict::Faster
    } else {
        Verdict::NotShown
    }
}

pub fn print(changes: &[Change], out: &mut dyn Write) -> Result<(), AppError> {
    for Change { what, shift, verdict } in changes {
        let word = match verdict {
            Verdict::Slower => "slower",
            Verdict::Faster => "faster",
            Verdict::NotShown => "no change shown",
        };
        writeln!(out, "{word:<16} x{:.3} ({:.3} to {:.3})  {what}", shift.ratio, shift.low, shift.high)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_is_not_blamed_on_the_program() {
        let shift = |ratio: f64| Shift { ratio, low: ratio * 0.99, high: ratio * 1.01 };
        assert_eq!(beyond(shift(1.05), [1.0, 1.0]), Verdict::Slower);
        assert_eq!(beyond(shift(1.05), [0.98, 1.06]), Verdict::NotShown);
        assert_eq!(beyond(shift(0.9), [0.95, 1.0]), Verdict::Faster);
        assert_eq!(beyond(shift(0.9), [0.85, 1.0]), Verdict::NotShown);
        assert_eq!(beyond(shift(1.0), [1.0, 1.0]), Verdict::NotShown);
    }
}
