// SPDX-License-Identifier: Apache-2.0
#include "offload/report/report_facts.h"

#include "common/bundle/atomic_file.h"
#include "offload/report/coverage_plot.h"
#include "offload/report/json_fields.h"
#include "offload/report/landmark_words.h"

#include <fmt/format.h>
#include <cmath>

namespace gyre {

namespace {

using nlohmann::json;

constexpr const char* stage_order[] = {"cameras", "cloud", "landmarks", "masks",   "poses",
                                       "shape",   "fit",   "detail",    "texture", "avatar"};

constexpr double accepted_height_error = 0.03;  // shoes, hair, posture

// Null when the file is not there; a damaged one is a warning too.
json read_object(const std::filesystem::path& file, std::vector<std::string>& warnings) {
  if (!std::filesystem::exists(file)) return {};
  const auto text = read_file(file);
  json object = text ? json::parse(*text, nullptr, false) : json();
  if (object.is_object()) return object;
  warnings.push_back("The file " + file.filename().string() + " of stage " + file.parent_path().filename().string() +
                     " could not be read.");
  return {};
}

std::vector<StageFacts> read_stages(const Bundle& bundle, std::vector<std::string>& warnings) {
  std::vector<StageFacts> stages;
  for (const char* name : stage_order) {
    const json record = read_object(bundle.work(name) / "stage.json", warnings);
    if (record.is_null()) continue;
    StageFacts stage;
    stage.name = name;
    stage.version = static_cast<int>(number_at(record, "/version", 0));
    stage.software = text_at(record, "/software");
    stage.seconds = number_at(record, "/seconds", 0);
    stage.cpu_seconds = number_at(record, "/cpu_seconds", 0);
    stage.peak_memory_mib = number_at(record, "/peak_memory_mib", 0);
    stage.options = record.value("options", json::object());
    stage.result = record.value("result", json::object());
    stages.push_back(std::move(stage));
  }
  return stages;
}

// Logs are outside input to a page: what is no plain text is shown as a question mark.
std::string plain(std::string_view text) {
  std::string shown(text);
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c != '\n' && c != '\t' && (c < ' ' || c > '~'); }, '?');
  return shown;
}

std::vector<FailedStage> read_logs(const Bundle& bundle) {
  constexpr std::size_t most = 4000;  // bytes of each
  std::vector<FailedStage> failed;
  for (const char* name : stage_order) {
    const auto log = read_file(bundle.work(std::string(name) + ".log"));
    if (!log || log->empty()) continue;
    const std::size_t from = log->size() > most ? log->find('\n', log->size() - most) : 0;
    failed.push_back(
        {name, plain(std::string_view(*log).substr(from == std::string::npos ? log->size() - most : from))});
  }
  return failed;
}

// What the lengths rest on, for the middle of a sentence; empty when it is not known.
std::string scale_source_text(const json& scene) {
  const std::string source = text_at(scene, "/scale_source");
  if (source == "board") return "the printed board";
  if (source == "turntable-radius") return "the turntable's radius";
  if (source == "height") return "the height given";
  if (source == "assumed-height") return "an assumed height";
  return {};
}

// A stature that was measured and one that was said should agree.
std::optional<std::string> height_warning(const ReportFacts& facts) {
  const std::string source = text_at(facts.scene, "/scale_source");
  if ((source != "board" && source != "turntable-radius") || !facts.scan.height_mm) return std::nullopt;
  const double measured = number_at(facts.scene, "/height_mm", *facts.scan.height_mm);
  const double doubt = 2 * number_at(facts.scene, "/height_uncertainty_mm", 0);
  if (std::abs(measured - *facts.scan.height_mm) <= std::max(doubt, accepted_height_error * measured))
    return std::nullopt;
  return fmt::format("The height given, {:.0f} mm, and the one measured with {}, {:.0f} mm, do not agree: check {}.",
                     *facts.scan.height_mm, scale_source_text(facts.scene), measured,
                     source == "board" ? "that the ruler on the board is 150 mm long" : "the turntable's radius");
}

// A walk that leaves a part of the subject unseen, or whose parts hang together on one side only.
std::optional<std::string> ring_warning(const json& scene) {
  const double covered = number_at(scene, "/ring/covered_deg", -1), gap = number_at(scene, "/ring/largest_gap_deg", 0);
  if (covered < 0 || flag_at(scene, "/ring/closed")) return std::nullopt;
  constexpr double seam = 30;
  if (gap > seam)
    return fmt::format(
        "The way around the subject is open: the camera saw it from {:.0f} of 360 degrees. What faces the gap of "
        "{:.0f} degrees is guessed; go all the way around to have it seen.",
        covered, gap);
  return "The way around the subject is not closed: its two ends were not recognised as the same place, so lengths "
         "across them may be wrong. Go a little farther than once around.";
}

// Passes that had nothing in common with the others but the subject's shape.
void add_join_warnings(const json& scene, std::vector<std::string>& warnings) {
  const json joined = scene.value("joined_by_shape", json::array());
  if (!joined.is_array()) return;
  for (const json& pass : joined)
    warnings.push_back(
        fmt::format("The pictures of pass {} show nothing that the others show as well: they were put in place by the "
                    "subject's shape, to about {:.1f} mm. Record all passes in one room and one light.",
                    text_at(pass, "/pass"), number_at(pass, "/residual_mm", 0)));
}

std::vector<std::string> find_warnings(const ReportFacts& facts) {
  std::vector<std::string> warnings;
  const std::size_t keyframes = facts.keyframes.size(), registered = facts.model.images.size();
  if (keyframes < 20)
    warnings.push_back(
        fmt::format("Only {} keyframes were captured; a full walk around the subject gives 75.", keyframes));
  if (registered > 0 && registered * 100 < keyframes * 95)
    warnings.push_back(
        fmt::format("{} of {} keyframes could not be placed and were not used.", keyframes - registered, keyframes));
  if (text_at(facts.scene, "/scale_source") == "assumed-height")
    warnings.push_back(
        fmt::format("The subject's height was not given: {:.0f} mm is assumed, and all lengths depend on it.",
                    number_at(facts.scene, "/height_mm", 1700)));
  if (const auto warning = height_warning(facts)) warnings.push_back(*warning);
  if (const std::vector<std::string> holes = hole_sentences(facts); !holes.empty())
    warnings.push_back(fmt::format("{} of the body {} hardly seen; the coverage below says where.",
                                   holes.size() == 1 ? "One place" : std::to_string(holes.size()) + " places",
                                   holes.size() == 1 ? "was" : "were"));
  if (const auto warning = ring_warning(facts.scene)) warnings.push_back(*warning);
  if (facts.scene.is_object()) add_join_warnings(facts.scene, warnings);
  if (flag_at(facts.fit, "/template/built_in"))
    warnings.emplace_back(
        "No human template was installed: the built-in stand-in was used, which has no face rig and a coarse body.");
  if (facts.fit.is_object() && facts.fit.contains("warnings") && facts.fit["warnings"].is_array())
    for (const json& warning : facts.fit["warnings"])
      if (warning.is_string()) warnings.push_back(warning.get<std::string>());
  return warnings;
}

std::string summarise(const ReportFacts& facts) {
  std::string text;
  if (facts.avatar_bytes > 0) {
    text = "The avatar is ready.";
  } else if (facts.fit.is_object()) {
    text = "The body was fitted, but there is no avatar yet.";
  } else if (facts.cloud.is_object()) {
    text = "A point cloud is ready; no avatar was made.";
  } else if (!facts.model.images.empty()) {
    text = "The cameras are known; nothing else was made yet.";
  } else {
    text = "Nothing has been reconstructed yet.";
  }
  if (!facts.model.images.empty())
    text += fmt::format(" {} of {} keyframes found their place.", facts.model.images.size(), facts.keyframes.size());
  if (const double stature = number_at(facts.fit, "/stature_mm", 0); stature > 0) {
    text += fmt::format(" The body is {:.2f} m tall", stature / 1000);
    const double residual = number_at(facts.fit, "/residual_mm/mean", -1);
    text += residual >= 0 ? fmt::format(" and lies within {:.1f} mm of the cloud on average.", residual) : ".";
  }
  if (const std::string source = scale_source_text(facts.scene); !source.empty()) {
    text += " All lengths rest on " + source;
    const double uncertainty = number_at(facts.scene, "/scale_uncertainty", -1);
    text += uncertainty >= 0 ? fmt::format(", to about {:.1f} %.", 100 * uncertainty) : ".";
  }
  double seconds = 0, memory = 0;
  for (const StageFacts& stage : facts.stages) {
    seconds += stage.seconds;
    memory = std::max(memory, stage.peak_memory_mib);
  }
  if (seconds > 0)
    text += fmt::format(" It took {} and at most {:.1f} GiB of memory.", duration_text(seconds), memory / 1024);
  return text;
}

}  // namespace

double ReportFacts::facing() const {
  return number_at(fit, "/yaw_deg", 0) * M_PI / 180;
}

const ModelImage* ReportFacts::image(const FrameId& frame) const {
  const std::string name = frame_name(frame.pass, frame.index);
  for (const auto& [id, candidate] : model.images)
    if (candidate.name == name) return &candidate;
  return nullptr;
}

std::string duration_text(double seconds) {
  if (seconds < 10) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<long>(std::lround(seconds));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

Result<ReportFacts> collect_facts(const Bundle& bundle) {
  ReportFacts facts;
  auto scan = read_scan(bundle);
  if (!scan) return tl::unexpected(scan.error());
  facts.scan = std::move(*scan);
  auto keyframes = list_frames(bundle);
  if (!keyframes) return tl::unexpected(keyframes.error());
  facts.keyframes = std::move(*keyframes);
  std::map<std::pair<std::string, int>, std::string> reasons;
  if (const auto log = read_frame_log(bundle))
    for (const FrameRecord& record : *log) reasons[{record.pass, record.index}] = record.reason;
  for (const FrameId& frame : facts.keyframes) {
    const auto reason = reasons.find({frame.pass, frame.index});
    facts.reasons.push_back(reason == reasons.end() ? "" : reason->second);
  }
  std::vector<std::string> damaged;
  if (std::filesystem::exists(bundle.work("cameras") / "images.txt")) {
    if (auto model = read_colmap_model(bundle.work("cameras"))) {
      facts.model = std::move(*model);
    } else {
      damaged.push_back(model.error().message());
    }
  }
  facts.scene = read_object(bundle.work("cameras") / "scene.json", damaged);
  facts.cloud = read_object(bundle.work("cloud") / "cloud.json", damaged);
  facts.coverage = read_object(bundle.work("cloud") / "coverage.json", damaged);
  if (const auto file = bundle.work("landmarks") / "landmarks.json"; std::filesystem::exists(file)) {
    if (auto landmarks = read_landmarks(file)) {
      facts.landmarks = std::move(*landmarks);
    } else {
      damaged.push_back(landmarks.error().message());
    }
  }
  facts.fit = read_object(bundle.work("fit") / "fit.json", damaged);
  facts.texture = read_object(bundle.work("texture") / "texture.json", damaged);
  facts.stages = read_stages(bundle, damaged);
  facts.failed = read_logs(bundle);
  std::error_code absent;
  const std::uintmax_t size = std::filesystem::file_size(bundle.work("avatar") / "avatar.glb", absent);
  facts.avatar_bytes = absent ? 0 : size;
  facts.warnings = find_warnings(facts);
  facts.warnings.insert(facts.warnings.end(), damaged.begin(), damaged.end());
  facts.summary = summarise(facts);
  return facts;
}

json to_json(const ReportFacts& facts) {
  json stages = json::array();
  double seconds = 0, memory = 0;
  for (const StageFacts& s : facts.stages) {
    stages.push_back({{"stage", s.name},
                      {"version", s.version},
                      {"software", s.software},
                      {"seconds", s.seconds},
                      {"cpu_seconds", s.cpu_seconds},
                      {"peak_memory_mib", s.peak_memory_mib},
                      {"options", s.options},
                      {"result", s.result}});
    seconds += s.seconds;
    memory = std::max(memory, s.peak_memory_mib);
  }
  json fit = nullptr;
  if (facts.fit.is_object()) {
    fit = json::object();
    for (const char* key :
         {"template", "stature_mm", "residual_mm", "yaw_deg", "shape", "scale", "measures", "support", "prior_only"})
      if (facts.fit.contains(key)) fit[key] = facts.fit[key];
  }
  return {{"scan", to_json(facts.scan)},
          {"software", GYRE_VERSION},
          {"summary", facts.summary},
          {"warnings", facts.warnings},
          {"keyframes", {{"count", facts.keyframes.size()}, {"registered", facts.model.images.size()}}},
          {"scene", facts.scene},
          {"cloud", facts.cloud},
          {"holes", hole_sentences(facts)},
          {"landmarks", facts.landmarks ? json(landmark_sentences(*facts.landmarks)) : json()},
          {"fit", fit},
          {"texture", facts.texture},
          {"avatar_bytes", facts.avatar_bytes},
          {"seconds", seconds},
          {"peak_memory_mib", memory},
          {"stages", stages}};
}

}  // namespace gyre
