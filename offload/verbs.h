// SPDX-License-Identifier: Apache-2.0
// The verbs of gyre-offload: each adds its subcommand and sets `run` when the command line asks for it.
#pragma once

#include "common/result/result.h"
#include "offload/pipeline/pipeline.h"

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace gyre {

// What the chosen verb does; returns the exit code.
using Verb = std::function<int()>;

void add_serve_verb(CLI::App& app, Verb& run);
void add_reconstruct_verb(CLI::App& app, Verb& run);
void add_stage_verb(CLI::App& app, Verb& run);
void add_template_verb(CLI::App& app, Verb& run);
void add_pair_verb(CLI::App& app, Verb& run);
void add_evaluate_verb(CLI::App& app, Verb& run);
void add_store_verb(CLI::App& app, Verb& run);

// Prints the error as one line on stderr and returns its exit code.
int report_error(const Error& error);

// Options of every verb that runs stages.
struct PipelineFlags {
  std::string body_template;          // file of the human template
  double height_mm = 0;               // 0: as scan.json says
  double turntable_radius_mm = 0;     // 0: not known
  int texture_size = 0;               // 0: the stage's default
  std::string texture_format;         // empty: the stage's default
  std::string joint_names, author;    // of the avatar; empty: the stage's default
  std::string picked_landmarks;       // JSON file of picked points
  std::string keypoint_network;       // ONNX file
  std::string keypoint_layout;        // "133" or "135"; empty: the stage's default
  std::vector<int> keypoint_size;     // width and height of the network's input; empty: the stage's default
  std::vector<std::string> settings;  // "stage.option=value"
  PipelineOptions pipeline;
};
void add_pipeline_flags(CLI::App& verb, PipelineFlags& flags);

// The flags as options of the runner. `scan_height_mm` is used when no height was given. Errors: a malformed setting, a
// template that is not there.
Result<PipelineOptions> pipeline_options(const PipelineFlags& flags, std::optional<double> scan_height_mm);

}  // namespace gyre
