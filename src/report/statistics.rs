//! From repeated times to statements: a median with its interval, and whether one thing is slower than another.
//!
//! Times of frames are skewed, drift with the machine, and have outliers; nothing here assumes a normal distribution.
//!
//! | question | answer |
//! |---|---|
//! | how long | [`Estimate`]: the median, with a bootstrap interval [Efron1979] |
//! | A or B, measured in turns | [`paired`]: the shift of log-times, by the signed-rank test [Wilcoxon1945] |
//! | then or now, measured apart | [`unpaired`]: the shift of log-times, by the rank-sum test [Mann1947] |
//!
//! Where A and B are alike, what is measured of both in one round can be swapped, so the difference of their logarithms
//! is symmetric around 0 whatever its distribution: the signed-rank test's rate of false alarms is what it says.
//!
//! [Efron1979]: crate::methods::PAPERS
//! [Wilcoxon1945]: crate::methods::PAPERS
//! [Mann1947]: crate::methods::PAPERS

use serde::{Deserialize, Serialize};

/// Rate of false alarms of [`Shift::verdict`].
pub const FALSE_ALARMS: f64 = 0.01;

const RESAMPLES: usize = 1000;

/// The middle value; the mean of the two middle ones where their number is even. `None` of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    median_of_sorted(&sorted)
}

fn median_of_sorted(sorted: &[f64]) -> Option<f64> {
    let count = sorted.len();
    (count > 0).then(|| 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]))
}

/// A median and where the true one lies with 95 % confidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    pub median: f64,
    pub low: f64,
    pub high: f64,
}

impl Estimate {
    /// Percentile bootstrap; the same values give the same interval. `None` of nothing.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = median_of_sorted(&sorted)?;
        let mut random = SplitMix64(sorted.len() as u64);
        let mut medians: Vec<f64> = (0..RESAMPLES)
            .filter_map(|_| {
                let mut copies = vec![0; sorted.len()];
                (0..sorted.len()).for_each(|_| copies[random.below(sorted.len())] += 1);
                let resampled =
                    copies.iter().zip(&sorted).flat_map(|(&copies, &value)| std::iter::repeat_n(value, copies));
                median_of_sorted(&resampled.collect::<Vec<f64>>())
            })
            .collect();
        medians.sort_by(f64::total_cmp);
        let at = |share: f64| medians[((RESAMPLES - 1) as f64 * share).round() as usize];
        Some(Self { median: middle, low: at(0.025), high: at(0.975) })
    }
}

/// How many times longer B takes than A: an estimate and an interval of confidence 1 - [`FALSE_ALARMS`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Shift {
    pub ratio: f64,
    pub low: f64,
    pub high: f64,
}

/// What a [`Shift`] shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Slower,
    Faster,
    /// Noise explains the difference, if there is one.
    NotShown,
}

impl Shift {
    pub fn verdict(&self) -> Verdict {
        if self.low > 1.0 {
            Verdict::Slower
        } else if self.high < 1.0 {
            Verdict::Faster
        } else {
            Verdict::NotShown
        }
    }

    /// From sorted log-ratios, of which the `cut` outermost at either end lie outside the interval. Where there are too
    /// few for any interval of the confidence, it is everything.
    fn of_sorted(logs: &[f64], cut: Option<usize>) -> Option<Self> {
        let ratio = median_of_sorted(logs)?.exp();
        let (low, high) = match cut.filter(|cut| 2 * cut < logs.len()) {
            Some(cut) => (logs[cut].exp(), logs[logs.len() - 1 - cut].exp()),
            None => (0.0, f64::INFINITY),
        };
        Some(Self { ratio, low, high })
    }
}

/// B against A, of pairs measured in one round each. `None` without pairs. Times are above 0.
pub fn paired(a: &[f64], b: &[f64]) -> Option<Shift> {
    let logs: Vec<f64> = a.iter().zip(b).map(|(a, b)| (b / a).ln()).collect();
    // Walsh averages: their median estimates the shift, their outer ones bound it.
    let mut averages = Vec::with_capacity(logs.len() * (logs.len() + 1) / 2);
    for (index, first) in logs.iter().enumerate() {
        averages.extend(logs[index..].iter().map(|second| 0.5 * (first + second)));
    }
    averages.sort_by(f64::total_cmp);
    Shift::of_sorted(&averages, signed_rank_cut(logs.len()))
}

/// B against A, measured apart. `None` where either is empty. Times are above 0.
pub fn unpaired(a: &[f64], b: &[f64]) -> Option<Shift> {
    let mut logs: Vec<f64> = a.iter().flat_map(|a| b.iter().map(move |b| (b / a).ln())).collect();
    logs.sort_by(f64::total_cmp);
    if logs.is_empty() {
        return None;
    }
    let (m, n) = (a.len() as f64, b.len() as f64);
    let deviation = (m * n * (m + n + 1.0) / 12.0).sqrt();
    let cut = (0.5 * m * n - TWO_SIDED * deviation).floor();
    Shift::of_sorted(&logs, (cut >= 1.0).then(|| cut as usize - 1))
}

/// Standard normal quantile of 1 - [`FALSE_ALARMS`] / 2.
const TWO_SIDED: f64 = 2.575_829_303_548_901;

/// How many Walsh averages at either end lie outside the interval: the largest `k` with P(W+ < k) <= half the false
/// alarms, W+ the sum of positive ranks of `n` signs by chance; less one, as an index. `None` for too few pairs.
fn signed_rank_cut(n: usize) -> Option<usize> {
    const EXACT: usize = 60;
    let total = n * (n + 1) / 2;
    if n > EXACT {
        let mean = 0.5 * total as f64;
        let deviation = (n as f64 * (n as f64 + 1.0) * (2.0 * n as f64 + 1.0) / 24.0).sqrt();
        return Some((mean - TWO_SIDED * deviation).floor() as usize);
    }
    // Chances of each sum of ranks, by adding one rank at a time.
    let mut chances = vec![0.0; total + 1];
    chances[0] = 1.0;
    for rank in 1..=n {
        for sum in (0..=total).rev() {
            let with = if sum >= rank { chances[sum - rank] } else { 0.0 };
            chances[sum] = 0.5 * (chances[sum] + with);
        }
    }
    let mut below = 0.0;
    let outside = chances.iter().take_while(|chance| {
        below += *chance;
        below <= 0.5 * FALSE_ALARMS
    });
    outside.count().checked_sub(1)
}

/// Whether times have settled: the medians of the last and the second-last `window` differ by less than `tolerance`, as
/// a share. `None` while there are fewer than two windows.
pub fn drift(values: &[f64], window: usize) -> Option<f64> {
    let recent = values.len().checked_sub(2 * window)?;
    let (before, after) = values[recent..].split_at(window);
    Some((median(after)? / median(before)? - 1.0).abs())
}

/// Counter-based random numbers [Steele2014].
///
/// [Steele2014]: crate::methods::PAPERS
#[derive(Debug, Clone)]
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In 0..`count`.
    pub fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next_u64()) * count as u128) >> 64) as usize
    }
}

#[cfg(test)]
#[path = "statistics_tests.rs"]
mod tests;
