//! Who is measured when: rounds of all subjects in a drawn order, until times have settled, then until the answer is
//! sharp or the time is over.

use crate::app::AppError;
use crate::report::statistics::{SplitMix64, drift, paired};

/// Rounds of which the medians are compared to see whether times have settled.
const WINDOW: usize = 4;
/// Settled: they differ by less than this share.
const SETTLED: f64 = 0.05;
/// Rounds of warming up after which measuring starts all the same.
const MAX_WARM_UP: usize = 24;
/// Fewer rounds than this cannot tell anything apart at the confidence asked for.
pub const MIN_ROUNDS: usize = 12;
/// More change nothing.
const MAX_ROUNDS: usize = 2000;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Half the width of the widest interval of a ratio to the first subject, as a share.
    pub precision: f64,
    /// Of measuring, warming up left out.
    pub seconds: f64,
}

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Rounds {
    /// Milliseconds by subject and round.
    pub times: Vec<Vec<f64>>,
    pub warm_up_rounds: usize,
    /// Largest drift over subjects at the end of warming up.
    pub drift: f64,
    pub settled: bool,
    /// Whether the precision was reached; if not, the time was over before.
    pub precise: bool,
}

/// Calls `measure(subject, is_warm)` for every subject once a round, in an order drawn anew each round: what slows the
/// machine for a while slows all alike. `seconds` is the time since some start.
///
/// Whether to stop depends on how sharp the answer is, never on what it is.
pub fn run(
    subjects: usize,
    limits: Limits,
    mut seconds: impl FnMut() -> f64,
    mut measure: impl FnMut(usize, bool) -> Result<f64, AppError>,
) -> Result<Rounds, AppError> {
    let mut random = SplitMix64(subjects as u64);
    let mut round = |times: &mut Vec<Vec<f64>>, is_warm: bool| -> Result<(), AppError> {
        let mut order: Vec<usize> = (0..subjects).collect();
        for last in (1..subjects).rev() {
            order.swap(last, random.below(last + 1));
        }
        for subject in order {
            times[subject].push(measure(subject, is_warm)?);
        }
        Ok(())
    };
    let mut warming = vec![Vec::new(); subjects];
    let largest_drift = |times: &[Vec<f64>]| {
        times.iter().map(|times| drift(times, WINDOW)).try_fold(0.0f64, |largest, drift| Some(largest.max(drift?)))
    };
    let drift = loop {
        round(&mut warming, false)?;
        match largest_drift(&warming) {
            Some(drift) if drift < SETTLED || warming[0].len() >= MAX_WARM_UP => break drift,
            _ => {}
        }
        if subjects == 0 {
            break 0.0;
        }
    };

    let mut times = vec![Vec::new(); subjects];
    let start = seconds();
    loop {
        round(&mut times, true)?;
        let count = times.first().map_or(MAX_ROUNDS, Vec::len);
        // Intervals cost a sort of all pairs of rounds: they are looked at now and then.
        let look = count >= MIN_ROUNDS && (count % 8 == 0 || count >= MAX_ROUNDS);
        let precise = look && half_width(&times) <= limits.precision;
        let over = count >= MAX_ROUNDS || (count >= MIN_ROUNDS && seconds() - start >= limits.seconds);
        if precise || over {
            let warm_up_rounds = warming.first().map_or(0, Vec::len);
            let precise = half_width(&times) <= limits.precision;
            return Ok(Rounds { times, warm_up_rounds, drift, settled: drift < SETTLED, precise });
        }
    }
}

/// Of the widest interval of a ratio to the first subject. One subject has only its own noise: its first half of rounds
/// against its second.
fn half_width(times: &[Vec<f64>]) -> f64 {
    let widths = match times {
        [] => return 0.0,
        [one] => {
            let (first, second) = one.split_at(one.len() / 2);
            vec![paired(first, second)]
        }
        [first, others @ ..] => others.iter().map(|other| paired(first, other)).collect(),
    };
    widths.iter().map(|shift| shift.map_or(f64::INFINITY, |s| 0.5 * (s.high - s.low) / s.ratio)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::statistics::Verdict;
    use std::cell::Cell;

    /// A machine of its own clock: noise, drift over time, a slow start, and an injected delay for the second subject.
    struct Simulated {
        random: SplitMix64,
        now_ms: f64,
        calls: usize,
    }

    impl Simulated {
        fn frame(&mut self, delay: f64) -> f64 {
            let uniform = (self.random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
            let disturbed = if uniform > 0.96 { 1.6 } else { 1.0 };
            let cold = 1.0 + 3.0 * (-(self.calls as f64) / 4.0).exp();
            let load = 1.0 + 0.2 * (self.now_ms / 700.0).sin();
            self.calls += 1;
            let ms = 10.0 * load * cold * disturbed * (1.0 + 0.06 * (uniform - 0.5)) * (1.0 + delay);
            self.now_ms += ms;
            ms
        }
    }

    fn verdict(seed: u64, delay: f64) -> (Verdict, Rounds) {
        let machine = std::cell::RefCell::new(Simulated { random: SplitMix64(seed), now_ms: 0.0, calls: 0 });
        let limits = Limits { precision: 0.01, seconds: 60.0 };
        let clock = || machine.borrow().now_ms * 1e-3;
        let rounds =
            run(2, limits, clock, |subject, _| Ok(machine.borrow_mut().frame(subject as f64 * delay))).unwrap();
        (paired(&rounds.times[0], &rounds.times[1]).unwrap().verdict(), rounds)
    }

    #[test]
    fn an_injected_delay_of_two_percent_is_found_and_none_is_not() {
        const TRIALS: u64 = 120;
        let found = (0..TRIALS).filter(|&seed| verdict(seed, 0.02).0 == Verdict::Slower).count();
        assert!(found as f64 >= 0.95 * TRIALS as f64, "{found} of {TRIALS}");
        let alarms = (0..TRIALS).filter(|&seed| verdict(seed, 0.0).0 != Verdict::NotShown).count();
        // 1 % is promised: 1.2 expected, 4.5 are three deviations more.
        assert!(alarms <= 4, "{alarms} of {TRIALS}");
    }

    #[test]
    fn the_cold_start_is_left_out_and_restlessness_is_told() {
        let (_, rounds) = verdict(3, 0.0);
        assert!(rounds.settled && rounds.warm_up_rounds >= 2 * WINDOW, "{rounds:?}");
        assert!(rounds.times.iter().flatten().all(|ms| *ms < 24.0), "no cold frame is kept");
        assert!(rounds.precise && rounds.times[0].len() >= MIN_ROUNDS);

        let calls = Cell::new(0);
        let growing = |_, _| {
            calls.set(calls.get() + 1);
            Ok(1.1f64.powi(calls.get()))
        };
        let restless = run(1, Limits { precision: 0.0, seconds: 0.0 }, || 0.0, growing).unwrap();
        assert!(!restless.settled && !restless.precise, "{restless:?}");
        assert_eq!((restless.warm_up_rounds, restless.times[0].len()), (MAX_WARM_UP, MIN_ROUNDS));
    }

    #[test]
    fn an_error_ends_the_measurement() {
        let fail = |_, _| Err(AppError::failed("lost"));
        assert!(run(1, Limits { precision: 0.1, seconds: 1.0 }, || 0.0, fail).is_err());
    }
}
