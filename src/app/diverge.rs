//! `linklight diverge A.json B.json`: the first pass in which two runs part, from what `linklight render --hashes` wrote.

use std::io::Write;

use super::AppError;
use super::cli::DivergeArgs;
use crate::report::pass_hashes::HashFile;

pub fn run(args: &DivergeArgs, out: &mut dyn Write) -> Result<(), AppError> {
    let read = |path| HashFile::read(path).map_err(AppError::failed);
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let again = args.again.as_deref().map(read).transpose()?;
    let found = a.first_difference(&b, again.as_ref());
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&found)?)?;
    } else {
        for (name, file) in [("A", &a), ("B", &b)] {
            let device = &file.device;
            writeln!(
                out,
                "{name}: {} by {} ({}), {} outputs",
                file.scene,
                device.name,
                device.driver,
                file.passes.len()
            )?;
        }
        match &found {
            Some(found) => writeln!(out, "they part at {found}")?,
            None => writeln!(out, "they are alike in every output of every pass")?,
        }
    }
    if found.is_some() && args.fail {
        return Err(AppError::AboveLimit("the runs differ".into()));
    }
    Ok(())
}
