// SPDX-License-Identifier: Apache-2.0
#include "offload/verbs.h"

#include "offload/body/template.h"
#include "offload/orbit.h"

#include <CLI/CLI.hpp>
#include <cstdio>

namespace gyre {

int report_error(const Error& error) {
  std::fprintf(stderr, "gyre-offload: %s\n", error.message().c_str());
  return error.exit_code();
}

void add_pipeline_flags(CLI::App& verb, PipelineFlags& flags) {
  verb.add_option(
      "--template", flags.body_template,
      "human template (GLB); default: $GYRE_TEMPLATE, the user's and the system's data folder, else a generated human");
  verb.add_option("--height-mm", flags.height_mm,
                  "stature of the subject, sole to top of hair, millimetres; default: as recorded with the scan")
      ->check(CLI::Range(300.0, 2600.0));
  verb.add_option("--turntable-radius-mm", flags.turntable_radius_mm,
                  "horizontal distance of the camera from the turntable's axis, millimetres; default: not known")
      ->check(CLI::Range(100.0, 20000.0));
  verb.add_option("--texture-size", flags.texture_size, "side of the texture, pixels; default: 4096")
      ->check(CLI::Range(1024, 8192));
  verb.add_option("--texture-format", flags.texture_format, "of the avatar's picture: png, jpeg; default: png")
      ->check(CLI::IsMember({"png", "jpeg"}));
  verb.add_option("--joint-names", flags.joint_names, "names of the avatar's joints: vrm, mixamo, unreal; default: vrm")
      ->check(CLI::IsMember({"vrm", "mixamo", "unreal"}));
  verb.add_option("--author", flags.author,
                  "who the avatar's licence names as its author; default: the person scanned");
  verb.add_option("--landmarks", flags.picked_landmarks,
                  "JSON file of landmarks picked in pictures or in space; they count more than any that are found");
  verb.add_option("--keypoint-network", flags.keypoint_network,
                  "ONNX whole-body keypoint network that helps to find landmarks; default: none, geometry alone");
  verb.add_option("--keypoint-layout", flags.keypoint_layout,
                  "keypoints of that network; default: 133 (COCO-WholeBody)")
      ->check(CLI::IsMember({"133", "135"}));
  verb.add_option("--keypoint-size", flags.keypoint_size,
                  "width and height of that network's input, pixels; default: 288 384. Its normalisation is set with "
                  "--set landmarks.network_mean, network_deviation (three numbers, 0 to 255) and network_rgb")
      ->expected(2)
      ->check(CLI::Range(8, 4096));
  verb.add_option("--set", flags.settings, "any option of a stage, as STAGE.OPTION=VALUE; may be given several times");
  verb.add_option("--until", flags.pipeline.until, "last stage to run; default: all");
  verb.add_option("--threads", flags.pipeline.threads, "threads; 0: one a core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  verb.add_option("--memory-gib", flags.pipeline.memory_gib, "memory the stages should stay below, GiB")
      ->check(CLI::Range(0.5, 1024.0))
      ->capture_default_str();
  verb.add_option("--seed", flags.pipeline.seed, "seed of every random choice")->capture_default_str();
}

Result<PipelineOptions> pipeline_options(const PipelineFlags& flags, std::optional<double> scan_height_mm) {
  PipelineOptions options = flags.pipeline;
  options.stage_options = nlohmann::json::object();
  for (const std::string& setting : flags.settings) {
    const std::size_t dot = setting.find('.');
    const std::size_t equals = setting.find('=');
    if (dot == std::string::npos || equals == std::string::npos || dot > equals) {
      return wrong_use("cannot understand a setting", setting, "write it as STAGE.OPTION=VALUE");
    }
    const std::string text = setting.substr(equals + 1);
    const nlohmann::json value = nlohmann::json::parse(text, nullptr, false);
    options.stage_options[setting.substr(0, dot)][setting.substr(dot + 1, equals - dot - 1)] =
        value.is_discarded() ? nlohmann::json(text) : value;
  }
  const Result<std::filesystem::path> body = find_template_file(flags.body_template);
  if (!body) return tl::unexpected(body.error());
  const double height_mm = flags.height_mm > 0 ? flags.height_mm : scan_height_mm.value_or(0.0);
  for (const Stage& stage : orbit_stages()) {
    const auto set = [&](const char* key, const nlohmann::json& value) {
      if (stage.options.contains(key)) options.stage_options[stage.name].emplace(key, value);
    };
    if (!body->empty()) set("template", std::filesystem::absolute(*body).string());
    if (height_mm > 0) set("height_mm", height_mm);
    if (flags.turntable_radius_mm > 0) set("turntable_radius_mm", flags.turntable_radius_mm);
    if (flags.texture_size > 0) set("size", flags.texture_size);
    if (!flags.texture_format.empty()) set("format", flags.texture_format);
    if (!flags.joint_names.empty()) set("joint_names", flags.joint_names);
    if (!flags.author.empty()) set("author", flags.author);
    if (!flags.picked_landmarks.empty()) set("picked", std::filesystem::absolute(flags.picked_landmarks).string());
    if (!flags.keypoint_network.empty()) set("network", std::filesystem::absolute(flags.keypoint_network).string());
    if (!flags.keypoint_layout.empty()) set("network_layout", flags.keypoint_layout);
    if (flags.keypoint_size.size() == 2) {
      set("network_width_px", flags.keypoint_size[0]);
      set("network_height_px", flags.keypoint_size[1]);
    }
  }
  return options;
}

}  // namespace gyre
