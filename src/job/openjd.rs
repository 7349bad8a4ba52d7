//! Writes a job bundle of `OpenJobDescription` 2023-09.
use super::Job;
use serde_json::{Value as Json, json};
use std::fmt::Write;

/// Folder of the parts until they are joined, and of the prepared results.
const PARTS: &str = "{{Param.OutDir}}/parts";
const CACHE: &str = "{{Param.OutDir}}/parts/cache";

/// Approximate number of chunks at the start of a sweep.
const CHUNKS: u32 = 100;

/// The job template, in YAML so that people can read it.
pub(super) fn template(job: &Job) -> String {
    let mut page = String::new();
    let memory = u64::from(job.memory) * 5 / 4 + 512;
    let (job, texts) = plain(job);
    let (job, name) = (&job, quoted(&job.name));
    let _ = write!(
        page,
        "specificationVersion: jobtemplate-2023-09
extensions: [TASK_CHUNKING]
name: {name}
parameterDefinitions:
  - name: Graph
    type: PATH
    objectType: FILE
    dataFlow: IN
    default: {graph}
    description: The graph file; what it reads lies beside it.
  - name: OutDir
    type: PATH
    objectType: DIRECTORY
    dataFlow: OUT
    default: out
    description: The folder for the pictures, which all machines must see.
  - name: Shibo
    type: STRING
    default: shibo
    description: The program.
{texts}steps:
",
        graph = quoted(&job.graph),
    );
    let graph = ["{{Param.Graph}}".to_owned()];
    let told = ["--progress", "openjd", "--quiet"].map(str::to_owned);
    let cache = ["--cache-dir", CACHE].map(str::to_owned);
    let needs = format!(
        "    hostRequirements:
      amounts:
        - {{name: amount.worker.vcpu, min: 1}}
        - {{name: amount.worker.memory, min: {memory}}}
"
    );
    if !job.sweep.is_empty() {
        page.push_str(&variants(job, &needs, &graph, &told));
        return page;
    }
    let prepare = [&["prepare".to_owned()], &graph[..], &job.common, &cache, &told].concat();
    page.push_str(&step("prepare", None, "", &needs, &prepare));
    let space = format!(
        "    parameterSpace:
      taskParameterDefinitions:
        - name: Part
          type: CHUNK[INT]
          range: \"1-{parts}\"
          chunks: {{defaultTaskCount: 1, targetRuntimeSeconds: 600, rangeConstraint: CONTIGUOUS}}
",
        parts = job.tasks
    );
    let part = ["--part".to_owned(), format!("{{{{Task.Param.Part}}}}/{}", job.tasks), "-o".into(), PARTS.into()];
    let render = [&["render".to_owned()], &graph[..], &part, &job.common, &job.rendering, &cache, &told].concat();
    page.push_str(&step("render", Some("prepare"), &space, &needs, &render));
    let memory = job.memory.to_string();
    let join = ["join", PARTS, "-o", "{{Param.OutDir}}", "--remove", "--memory", &memory].map(str::to_owned);
    page.push_str(&step("join", Some("render"), "", &needs, &[&join[..], &told].concat()));
    page
}

/// Replaces words that contain a scheduler's placeholder by parameters, whose values are used verbatim; returns the job
/// and the definitions of the parameters. A template has no escape for two braces.
fn plain(job: &Job) -> (Job, String) {
    let mut texts = String::new();
    let mut count = 0;
    let mut word = |word: &String| {
        if !["{{", "}}"].iter().any(|braces| word.contains(braces)) {
            return word.clone();
        }
        count += 1;
        let text = quoted(word);
        let _ = write!(
            texts,
            "  - name: Text{count}
    type: STRING
    default: {text}
    description: A word with braces, which stands as it is.
"
        );
        format!("{{{{Param.Text{count}}}}}")
    };
    let plain = Job {
        name: word(&job.name),
        graph: job.graph.clone(),
        tasks: job.tasks,
        sweep: job.sweep.iter().map(&mut word).collect(),
        memory: job.memory,
        threads: job.threads,
        common: job.common.iter().map(&mut word).collect(),
        rendering: job.rendering.iter().map(&mut word).collect(),
    };
    (plain, texts)
}

/// Steps of a sweep: chunks of variants, and the list of all variants.
fn variants(job: &Job, needs: &str, graph: &[String], told: &[String]) -> String {
    let space = format!(
        "    parameterSpace:
      taskParameterDefinitions:
        - name: Variant
          type: CHUNK[INT]
          range: \"1-{variants}\"
          chunks: {{defaultTaskCount: {chunk}, targetRuntimeSeconds: 600, rangeConstraint: CONTIGUOUS}}
",
        variants = job.tasks,
        chunk = job.tasks.div_ceil(CHUNKS),
    );
    let out = ["-o", "{{Param.OutDir}}", "--cache-dir", "{{Param.OutDir}}/cache"].map(str::to_owned);
    let start = [&["render".to_owned()], graph, &job.sweep];
    let rest = [&job.common[..], &job.rendering, &out, told].concat();
    let some = ["--variants".to_owned(), "{{Task.Param.Variant}}".to_owned()];
    let render = [&start.concat()[..], &some, &rest].concat();
    let list = [&start.concat()[..], &rest].concat();
    step("render", None, &space, needs, &render) + &step("list", Some("render"), "", needs, &list)
}

fn step(name: &str, after: Option<&str>, space: &str, needs: &str, words: &[String]) -> String {
    let after = after.map_or(String::new(), |after| format!("    dependencies:\n      - dependsOn: {after}\n"));
    let mut args = String::new();
    for word in words {
        let _ = writeln!(args, "            - {}", quoted(word));
    }
    format!(
        "  - name: {name}
{after}{space}{needs}    script:
      actions:
        onRun:
          command: \"{{{{Param.Shibo}}}}\"
          args:
{args}"
    )
}

/// Default parameter values for the scheduler.
pub(super) fn values(job: &Job) -> String {
    let of = |name: &str, value: &str| json!({ "name": name, "value": value });
    let values = Json::Array(vec![of("Graph", &job.graph), of("OutDir", "out"), of("Shibo", "shibo")]);
    lines("parameterValues", &values)
}

/// Files to copy to the machines.
pub(super) fn assets() -> String {
    "assetReferences:
  inputs:
    filenames: []
    directories:
      - graph
  outputs:
    directories:
      - out
  referencedPaths: []
"
    .to_owned()
}

fn lines(name: &str, list: &Json) -> String {
    let items = list.as_array().into_iter().flatten();
    let items = items.map(|item| format!("  - {item}\n")).collect::<String>();
    format!("{name}:\n{items}")
}

/// Quotes a text for YAML.
fn quoted(text: &str) -> String {
    Json::from(text).to_string()
}
