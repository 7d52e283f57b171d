// SPDX-License-Identifier: Apache-2.0
#include "offload/page/scan_view.h"

#include "common/bundle/atomic_file.h"
#include "offload/pipeline/pipeline.h"

#include <algorithm>

namespace gyre {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json read_json(const fs::path& file) {
  const Result<std::string> text = read_file(file);
  return text ? json::parse(*text, nullptr, false) : json();
}

// Options that name files are for the operator of this machine alone.
bool is_settable(const Stage& stage, const std::string& option) {
  return std::find(stage.external.begin(), stage.external.end(), option) == stage.external.end();
}

json stage_view(const Stage& stage, const Bundle& bundle) {
  const json record = read_json(bundle.work(stage.name) / "stage.json");
  const bool done = record.is_object();
  const json recorded = done ? record.value("options", json::object()) : json::object();
  json options = json::object();
  for (const auto& [name, preset] : stage.options.items()) {
    if (is_settable(stage, name)) options[name] = recorded.value(name, preset);
  }
  return {{"name", stage.name},
          {"done", done},
          {"seconds", done ? record.value("seconds", 0.0) : 0.0},
          {"options", std::move(options)}};
}

bool same_type(const json& value, const json& preset) {
  if (preset.is_number()) return value.is_number();
  return value.type() == preset.type();
}

}  // namespace

const std::vector<std::string>& result_names() {
  static const std::vector<std::string> names = {"avatar.glb",    "avatar.vrm",  "avatar.fbx", "avatar-50.glb",
                                                 "avatar-25.glb", "report.html", "report.json"};
  return names;
}

fs::path result_file(const Bundle& bundle, const std::string& name) {
  const bool is_level = name == "avatar-50.glb" || name == "avatar-25.glb";
  return (is_level ? bundle.work("avatar") : bundle.root()) / name;
}

namespace {

// What the device says while it records that very scan.
std::string words_of(const std::optional<DeviceView>& device, const std::string& scan_id) {
  if (!device || !device->status || device->status->scan != scan_id) return {};
  if (!device->connected) return "the device is out of reach";
  return device->status->text.empty() ? device->status->state : device->status->text;
}

json coverage_view(const wire::CoveragePreview& preview) {
  json bands = json::array();
  for (const wire::CoverageBand& band : preview.bands) {
    json cells = json::array();
    for (const char cell : band.cells) cells.push_back(static_cast<unsigned char>(cell));
    bands.push_back({{"name", band.name}, {"share", band.share}, {"cells", std::move(cells)}});
  }
  return {{"scan", preview.scan}, {"pass", preview.pass}, {"bands", std::move(bands)}};
}

}  // namespace

json device_row(const DeviceView& device) {
  json status;
  if (device.status) {
    const wire::DeviceStatus& told = *device.status;
    status = {{"state", told.state},
              {"text", told.text},
              {"scan", told.scan},
              {"free_bytes", told.free_bytes},
              {"waiting_scans", told.waiting_scans},
              {"waiting_files", told.waiting_files}};
  }
  return {{"name", device.name},
          {"connected", device.connected},
          {"since", device.since},
          {"status", std::move(status)},
          {"coverage", device.coverage ? coverage_view(*device.coverage) : json()}};
}

json scan_row(const Store& store, const StoredScan& scan, const std::optional<ScanActivity>& work, bool importing,
              const std::optional<DeviceView>& device) {
  const Bundle bundle = store.bundle(scan.id);
  std::error_code error;
  json files = json::array();
  for (const std::string& name : result_names()) {
    if (fs::exists(result_file(bundle, name), error)) files.push_back(name);
  }
  const Result<std::vector<FrameId>> frames = list_frames(bundle);
  const std::size_t count = frames ? frames->size() : 0;
  return {{"id", scan.id},
          {"device", scan.device_name},
          {"created", scan.created},
          {"phase", importing ? std::string("importing") : std::string(name_of(scan.phase))},
          {"reason", scan.reason},
          {"delivered", scan.delivered},
          {"keyframes", count},
          {"cover", count > 0 ? frame_name(frames->front().pass, frames->front().index) : std::string()},
          {"stage", work ? work->stage : ""},
          {"fraction", work ? work->fraction : 0.0},
          {"text", work ? work->text : ""},
          {"device_text", scan.phase == StorePhase::receiving ? words_of(device, scan.id) : std::string()},
          {"coverage",
           device && device->coverage && device->coverage->scan == scan.id ? coverage_view(*device->coverage) : json()},
          {"files", std::move(files)}};
}

json scan_details(const Store& store, const json& row, const std::string& id, const std::vector<Stage>& stages) {
  const Bundle bundle = store.bundle(id);
  json view = row;
  const Result<Scan> scan = read_scan(bundle);
  view["height_mm"] = scan && scan->height_mm ? json(*scan->height_mm) : json();
  view["stages"] = json::array();
  for (const Stage& stage : stages) view["stages"].push_back(stage_view(stage, bundle));
  const json report = read_json(bundle.root() / "report.json");
  view["warnings"] = report.is_object() ? report.value("warnings", json::array()) : json::array();
  std::error_code error;
  view["texture_sources"] = fs::exists(bundle.work("texture") / "source.png", error);
  return view;
}

Result<void> check_page_options(const json& options, const std::vector<Stage>& stages) {
  if (!options.is_object()) return wrong_use("options are an object of stages", "", "send {\"stage\": {...}}");
  if (const Result<void> known = check_stage_options(stages, options); !known) return known;
  for (const Stage& stage : stages) {
    const json given = options.value(stage.name, json::object());
    for (const auto& [option, value] : given.items()) {
      if (!is_settable(stage, option)) {
        return wrong_use("an option that names a file is not set from the page", stage.name + "." + option,
                         "start gyre-offload with it");
      }
      if (!value.is_null() && !same_type(value, stage.options.at(option))) {
        return wrong_use("an option has a value of the wrong kind", stage.name + "." + option);
      }
    }
  }
  return {};
}

}  // namespace gyre
