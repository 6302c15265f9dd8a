//! Alias tables: a choice among many by given probabilities, in constant time.

/// Vose's alias method: (threshold, alias) per entry. `probabilities` sum to one.
pub fn alias_table(probabilities: &[f64]) -> Vec<(f32, u32)> {
    let count = probabilities.len() as f64;
    let mut scaled: Vec<f64> = probabilities.iter().map(|probability| probability * count).collect();
    let mut table: Vec<(f32, u32)> = (0..probabilities.len() as u32).map(|index| (1.0, index)).collect();
    let (mut small, mut large): (Vec<u32>, Vec<u32>) =
        (0..probabilities.len() as u32).partition(|&index| scaled[index as usize] < 1.0);
    while let (Some(under), Some(&over)) = (small.pop(), large.last()) {
        let left = scaled[under as usize];
        table[under as usize] = (left as f32, over);
        scaled[over as usize] -= 1.0 - left;
        if scaled[over as usize] < 1.0 {
            large.pop();
            small.push(over);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::alias_table;

    #[test]
    fn every_entry_is_drawn_by_its_probability() {
        let weights = [3.0, 0.0, 1.0, 0.5, 7.5, 1e-9, 2.0];
        let total: f64 = weights.iter().sum();
        let probabilities = weights.map(|weight| weight / total);
        let table = alias_table(&probabilities);
        let mut drawn = [0.0; 7];
        for (entry, &(threshold, alias)) in table.iter().enumerate() {
            drawn[entry] += f64::from(threshold) / 7.0;
            drawn[alias as usize] += f64::from(1.0 - threshold) / 7.0;
        }
        for (drawn, expected) in drawn.iter().zip(probabilities) {
            assert!((drawn - expected).abs() < 1e-7, "{drawn} for {expected}");
        }
    }
}
