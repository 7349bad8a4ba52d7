//! Writes a job for Slurm: one script that submits itself three times.
use super::Job;

/// Maximum number of tasks of an array: below the default limit of Slurm.
const MOST: u32 = 1000;

/// Default number of cores per task.
const CORES: u16 = 2;

/// Uses as many threads as the task has cores.
const THREADS: &str = " --threads \"${SLURM_CPUS_PER_TASK:-0}\"";

/// Command that submits the script for a task. `%` in names of logs is a placeholder and is doubled.
fn submit(job: &Job) -> String {
    let (name, memory) = (quoted(&job.name), u64::from(job.memory) * 5 / 4 + 512);
    let cores = if job.threads > 0 { job.threads } else { CORES };
    format!(
        r#"cores=${{SHIBO_CORES:-{cores}}}
log=${{out//%/%%}}/log
submit() {{
    local task=$1
    shift
    sbatch --parsable --job-name {name}-"$task" --mem {memory} --cpus-per-task "$cores" --kill-on-invalid-dep=yes \
        --output "$log/$task-%j-%a.txt" "$@" "$here/submit.sh" --task "$task" "$here" "$out"
}}
"#
    )
}

/// The script.
pub(super) fn script(job: &Job) -> String {
    if !job.sweep.is_empty() {
        return sweep(job);
    }
    let words = |words: &[String]| words.iter().map(|word| format!(" {}", quoted(word))).collect::<String>();
    let graph = quoted(&job.graph);
    let (parts, join_memory) = (job.tasks, job.memory);
    let (common, rendering) = (words(&job.common) + THREADS, words(&job.rendering));
    let submit = submit(job);
    format!(
        r#"#!/bin/bash
# Renders a graph with Slurm:   ./submit.sh [OUTDIR]
# All nodes must see this folder and OUTDIR, and have `shibo` on their path (or as $SHIBO). Run it again after a failure:
# parts that are there are not rendered again. Options for sbatch, such as a partition: $SBATCH_PARTITION
# and the like; the cores of a task: $SHIBO_CORES.
set -euo pipefail
shibo=${{SHIBO:-shibo}}

if [ "${{1:-}}" = --task ]; then
    task=$2 here=$3 out=$4
    cd "$here"
    case $task in
        prepare) "$shibo" prepare {graph}{common} --cache-dir "$out/parts/cache" ;;
        render) "$shibo" render {graph} --part "$SLURM_ARRAY_TASK_ID/{parts}" -o "$out/parts"{common}{rendering} --cache-dir "$out/parts/cache" ;;
        join) "$shibo" join "$out/parts" -o "$out" --remove --memory {join_memory} ;;
    esac
    exit
fi

here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "${{1:-$here/out}}/log"
out=$(cd "${{1:-$here/out}}" && pwd)
{submit}prepare=$(submit prepare)
render=$(submit render --array=1-{parts} --dependency="afterok:${{prepare%%;*}}")
join=$(submit join --dependency="afterok:${{render%%;*}}")
echo "submitted: prepare ${{prepare%%;*}}, render ${{render%%;*}} ({parts} tasks), join ${{join%%;*}}; the pictures come into $out"
"#
    )
}

/// Script of a sweep.
fn sweep(job: &Job) -> String {
    let words = |words: &[String]| words.iter().map(|word| format!(" {}", quoted(word))).collect::<String>();
    let graph = quoted(&job.graph);
    let variants = job.tasks;
    let each = variants.div_ceil(MOST);
    let tasks = variants.div_ceil(each);
    let how = words(&[&job.sweep[..], &job.common, &job.rendering].concat()) + THREADS;
    let submit = submit(job);
    format!(
        r#"#!/bin/bash
# Renders the variants of a graph with Slurm:   ./submit.sh [OUTDIR]
# All nodes must see this folder and OUTDIR, and have `shibo` on their path (or as $SHIBO). Run it again after a failure:
# variants that are there are not rendered again. Options for sbatch, such as a partition: $SBATCH_PARTITION
# and the like; the cores of a task: $SHIBO_CORES.
set -euo pipefail
shibo=${{SHIBO:-shibo}}

if [ "${{1:-}}" = --task ]; then
    task=$2 here=$3 out=$4
    cd "$here"
    some=()
    if [ "$task" = render ]; then
        first=$(((SLURM_ARRAY_TASK_ID - 1) * {each} + 1))
        last=$((SLURM_ARRAY_TASK_ID * {each}))
        some=(--variants "$first-$((last < {variants} ? last : {variants}))")
    fi
    "$shibo" render {graph}{how} -o "$out" --cache-dir "$out/cache" "${{some[@]}}"
    exit
fi

here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "${{1:-$here/out}}/log"
out=$(cd "${{1:-$here/out}}" && pwd)
{submit}render=$(submit render --array=1-{tasks})
list=$(submit list --dependency="afterok:${{render%%;*}}")
echo "submitted: render ${{render%%;*}} ({variants} variants in {tasks} tasks), list ${{list%%;*}}; the pictures come into $out"
"#
    )
}

/// Quotes a word for a shell.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_words_for_shell() {
        for word in ["a b", "it's", "$(rm -rf /)", "`x`", "\"", "a\nb", "", "*", "\\"] {
            let output =
                std::process::Command::new("bash").args(["-c", &format!("printf %s {}", quoted(word))]).output();
            assert_eq!(output.unwrap().stdout, word.as_bytes(), "{word:?}");
        }
    }
}
