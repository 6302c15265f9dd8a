//! The statistics on data with known answers: rates of false alarms and of missed changes, by simulation.

use super::*;

/// Times like a busy machine's: skewed noise, drift over the rounds, one round in twenty disturbed.
struct Machine {
    random: SplitMix64,
}

impl Machine {
    fn uniform(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let (u, v) = (self.uniform().max(1e-300), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    fn time(&mut self, round: usize, slowdown: f64) -> f64 {
        let drift = 1.0 + 0.05 * (round as f64 * 0.3).sin();
        let disturbed = if self.uniform() < 0.05 { 1.0 + self.uniform() } else { 1.0 };
        10.0 * slowdown * drift * disturbed * (0.02 * self.normal()).exp()
    }

    fn rounds(&mut self, count: usize, slowdown: f64) -> [Vec<f64>; 2] {
        let mut times = [Vec::new(), Vec::new()];
        for round in 0..count {
            times[0].push(self.time(round, 1.0));
            times[1].push(self.time(round, slowdown));
        }
        times
    }
}

const TRIALS: usize = 400;

fn rate(seed: u64, rounds: usize, slowdown: f64, wanted: Verdict) -> f64 {
    let mut machine = Machine { random: SplitMix64(seed) };
    let hits = (0..TRIALS).filter(|_| {
        let [a, b] = machine.rounds(rounds, slowdown);
        paired(&a, &b).unwrap().verdict() == wanted
    });
    hits.count() as f64 / TRIALS as f64
}

#[test]
fn alike_is_seldom_called_different() {
    for rounds in [12, 40, 80] {
        let alarms = rate(1, rounds, 1.0, Verdict::Slower) + rate(1, rounds, 1.0, Verdict::Faster);
        // 1 % is promised; three deviations of 400 trials are 1.5 %.
        assert!(alarms < 0.025, "{alarms} of {rounds} rounds");
    }
    // Apart, on a machine that does not drift between the two.
    let mut machine = Machine { random: SplitMix64(2) };
    let alarms = (0..TRIALS).filter(|_| {
        let [a, b] = machine.rounds(40, 1.0);
        unpaired(&a, &b).unwrap().verdict() != Verdict::NotShown
    });
    assert!(alarms.count() < 10);
}

#[test]
fn two_percent_are_found() {
    let found = rate(3, 80, 1.02, Verdict::Slower);
    assert!(found >= 0.95, "{found}");
    let found = rate(4, 80, 1.0 / 1.02, Verdict::Faster);
    assert!(found >= 0.95, "{found}");
    // The comparator can fail: too few rounds do not show it.
    let found = rate(5, 10, 1.02, Verdict::Slower);
    assert!(found < 0.5, "{found}");
}

#[test]
fn intervals_hold_the_truth() {
    let mut machine = Machine { random: SplitMix64(6) };
    let (mut shifts, mut medians) = (0, 0);
    const TRIALS: usize = 200;
    for _ in 0..TRIALS {
        let [a, b] = machine.rounds(40, 1.1);
        let shift = paired(&a, &b).unwrap();
        shifts += usize::from((shift.low..shift.high).contains(&1.1));
        // Of the pure noise the median is known.
        let times: Vec<f64> = (0..40).map(|_| (0.1 * machine.normal()).exp()).collect();
        let estimate = Estimate::of(&times).unwrap();
        medians += usize::from((estimate.low..=estimate.high).contains(&1.0));
    }
    assert!(shifts >= 193, "{shifts} of {TRIALS}");
    assert!((178..=199).contains(&medians), "{medians} of {TRIALS}");
}

/// Critical values of the signed-rank test as tabulated for two-sided 0.01: n = 8: 0, 10: 3, 15: 15, 20: 37, 30: 109.
#[test]
fn signed_ranks_are_cut_where_the_tables_say() {
    for (n, critical) in [(8, 0), (10, 3), (15, 15), (20, 37), (30, 109)] {
        assert_eq!(signed_rank_cut(n), Some(critical), "{n}");
    }
    assert_eq!(signed_rank_cut(7), None);
    let (exact, approximate) = (signed_rank_cut(60).unwrap(), signed_rank_cut(61).unwrap());
    assert!(approximate > exact && approximate < exact + 30, "{exact} {approximate}");
}

#[test]
fn few_values_say_little() {
    assert_eq!((median(&[]), Estimate::of(&[])), (None, None));
    assert_eq!(median(&[3.0, 1.0, 2.0, 10.0]), Some(2.5));
    assert_eq!((paired(&[], &[]), unpaired(&[1.0], &[])), (None, None));
    let few = paired(&[1.0; 7], &[2.0; 7]).unwrap();
    assert_eq!((few.verdict(), few.ratio), (Verdict::NotShown, 2.0));
    assert_eq!(paired(&[1.0; 8], &[2.0; 8]).unwrap().verdict(), Verdict::Slower);
    let one = Estimate::of(&[4.0]).unwrap();
    assert_eq!((one.low, one.median, one.high), (4.0, 4.0, 4.0));
    assert_eq!(drift(&[1.0, 1.0, 2.0], 2), None);
    assert_eq!(drift(&[9.0, 1.0, 1.0, 1.5, 1.5], 2), Some(0.5));
}
