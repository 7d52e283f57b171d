// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/bundle.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/ulid.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

using nlohmann::json;

// Runs a conversion that may meet a missing or mistyped member; `what` names the document.
template <class Convert>
auto checked(const char* what, Convert convert) -> Result<decltype(convert())> {
  try {
    return convert();
  } catch (const json::exception& e) {
    return fail(what, e.what(), "the file is damaged or of another version");
  }
}

std::optional<double> optional_number(const json& j, const char* key) {
  const auto it = j.find(key);
  return it == j.end() || it->is_null() ? std::nullopt : std::optional<double>(it->get<double>());
}

Camera camera_of(const json& j) {
  Camera c;
  c.width = j.at("width");
  c.height = j.at("height");
  c.fx = j.at("fx");
  c.fy = j.at("fy");
  c.cx = j.at("cx");
  c.cy = j.at("cy");
  c.k1 = j.value("k1", 0.0);
  c.k2 = j.value("k2", 0.0);
  c.p1 = j.value("p1", 0.0);
  c.p2 = j.value("p2", 0.0);
  c.k3 = j.value("k3", 0.0);
  return c;
}

}  // namespace

std::filesystem::path Bundle::frame(std::string_view pass, int index) const {
  return frames() / frame_name(pass, index);
}

std::string frame_name(std::string_view pass, int index) {
  char number[16];
  std::snprintf(number, sizeof number, "%06d", index);
  return std::string(pass) + "-" + number + ".jpg";
}

std::optional<FrameId> parse_frame_name(std::string_view name) {
  constexpr std::size_t tail = 11;  // "-000000.jpg"
  if (name.size() <= tail || !name.ends_with(".jpg") || name[name.size() - tail] != '-') return std::nullopt;
  FrameId id;
  id.pass = name.substr(0, name.size() - tail);
  const char* first = name.data() + name.size() - tail + 1;
  const auto [end, error] = std::from_chars(first, first + 6, id.index);
  if (error != std::errc() || end != first + 6 || !is_safe_name(id.pass)) return std::nullopt;
  return id;
}

bool is_safe_name(std::string_view name) {
  constexpr std::size_t longest = 200;
  if (name.empty() || name.size() > longest || name.front() == '.') return false;
  return std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '.';
  });
}

json to_json(const Camera& c) {
  return {{"width", c.width}, {"height", c.height}, {"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx}, {"cy", c.cy},
          {"k1", c.k1},       {"k2", c.k2},         {"p1", c.p1}, {"p2", c.p2}, {"k3", c.k3}};
}

Result<Camera> camera_from_json(const json& j) {
  Result<Camera> camera = checked("cannot read a camera", [&] { return camera_of(j); });
  if (camera && (camera->width <= 0 || camera->height <= 0 || camera->fx <= 0 || camera->fy <= 0)) {
    return fail("cannot read a camera", "size and focal length must be positive");
  }
  return camera;
}

json to_json(const Scan& scan) {
  json passes = json::array();
  for (const ScanPass& p : scan.passes) {
    passes.push_back(
        {{"name", p.name}, {"fps", p.fps}, {"frame_count", p.frame_count}, {"width", p.width}, {"height", p.height}});
    if (p.focal_35mm) passes.back()["focal_35mm"] = *p.focal_35mm;
  }
  return {{"format", Scan::format_version},
          {"id", scan.id},
          {"mode", scan.mode},
          {"device", scan.device},
          {"created", scan.created},
          {"software", scan.software},
          {"height_mm", scan.height_mm ? json(*scan.height_mm) : json()},
          {"camera", scan.camera ? to_json(*scan.camera) : json()},
          {"passes", passes}};
}

Result<Scan> scan_from_json(const json& j) {
  Result<Scan> scan = checked("cannot read scan.json", [&] {
    Scan s;
    if (j.at("format").get<int>() > Scan::format_version) {
      throw json::other_error::create(501, "written by a newer version of Gyre", nullptr);
    }
    s.id = j.at("id");
    s.mode = j.at("mode");
    s.device = j.value("device", "");
    s.created = j.value("created", "");
    s.software = j.value("software", "");
    s.height_mm = optional_number(j, "height_mm");
    if (const auto it = j.find("camera"); it != j.end() && !it->is_null()) s.camera = camera_of(*it);
    for (const json& p : j.at("passes")) {
      s.passes.push_back({p.at("name"), p.value("fps", 0.0), p.value("frame_count", 0), p.value("width", 0),
                          p.value("height", 0), optional_number(p, "focal_35mm")});
    }
    return s;
  });
  if (!scan) return scan;
  if (!is_ulid(scan->id)) return fail("cannot read scan.json", "the scan id is not a ULID");
  if (scan->mode != "orbit" && scan->mode != "turn") return fail("cannot read scan.json", "unknown mode " + scan->mode);
  for (const ScanPass& p : scan->passes) {
    if (!is_safe_name(p.name)) return fail("cannot read scan.json", "a pass has an unusable name");
  }
  return scan;
}

json to_json(const FrameRecord& r) {
  json j = {{"pass", r.pass},
            {"index", r.index},
            {"time_s", r.time},
            {"motion", r.motion},
            {"smoothed_motion", r.smoothed_motion},
            {"sharpness", r.sharpness},
            {"decision", r.decision},
            {"reason", r.reason}};
  const auto put = [&](const char* key, const std::optional<double>& value) {
    if (value) j[key] = *value;
  };
  put("exposure_s", r.exposure_s);
  put("gain", r.gain);
  put("lens_position", r.lens_position);
  put("azimuth", r.azimuth);
  put("height_band", r.height_band);
  return j;
}

Result<FrameRecord> frame_record_from_json(const json& j) {
  return checked("cannot read a frame record", [&] {
    FrameRecord r;
    r.pass = j.at("pass");
    r.index = j.at("index");
    r.time = j.at("time_s");
    r.motion = j.at("motion");
    r.smoothed_motion = j.at("smoothed_motion");
    r.sharpness = j.at("sharpness");
    r.decision = j.at("decision");
    r.reason = j.at("reason");
    r.exposure_s = optional_number(j, "exposure_s");
    r.gain = optional_number(j, "gain");
    r.lens_position = optional_number(j, "lens_position");
    r.azimuth = optional_number(j, "azimuth");
    r.height_band = optional_number(j, "height_band");
    return r;
  });
}

Result<Bundle> create_bundle(const std::filesystem::path& root, const Scan& scan) {
  Bundle bundle(root);
  std::error_code error;
  std::filesystem::create_directories(bundle.frames(), error);
  if (error)
    return fail("cannot create the scan folder", root.string() + " (" + error.message() + ")",
                "choose a folder you may write to");
  if (Result<void> written = write_scan(bundle, scan); !written) return tl::unexpected(written.error());
  return bundle;
}

Result<void> write_scan(const Bundle& bundle, const Scan& scan) {
  return write_file(bundle.scan_file(), to_json(scan).dump(2) + "\n");
}

Result<Scan> read_scan(const Bundle& bundle) {
  const Result<std::string> text = read_file(bundle.scan_file());
  if (!text) return fail("not a scan", bundle.root().string(), "it has no readable scan.json");
  const json j = json::parse(*text, nullptr, false);
  if (j.is_discarded()) return fail("cannot read scan.json", bundle.scan_file().string(), "the file is damaged");
  return scan_from_json(j);
}

Result<void> write_frame_log(const Bundle& bundle, const std::vector<FrameRecord>& records) {
  std::string text;
  for (const FrameRecord& r : records) text += to_json(r).dump() + "\n";
  return write_file(bundle.frame_log(), text);
}

Result<std::vector<FrameRecord>> read_frame_log(const Bundle& bundle) {
  const Result<std::string> text = read_file(bundle.frame_log());
  if (!text) return tl::unexpected(text.error());
  std::vector<FrameRecord> records;
  std::istringstream in(*text);
  for (std::string line; std::getline(in, line);) {
    if (line.empty()) continue;
    const json j = json::parse(line, nullptr, false);
    Result<FrameRecord> record = frame_record_from_json(j);
    if (!record) {
      record.error().where = bundle.frame_log().string() + ":" + std::to_string(records.size() + 1);
      return tl::unexpected(record.error());
    }
    records.push_back(std::move(*record));
  }
  return records;
}

Result<std::vector<FrameId>> list_frames(const Bundle& bundle) {
  std::vector<FrameId> frames;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(bundle.frames(), error)) {
    if (std::optional<FrameId> id = parse_frame_name(entry.path().filename().string()))
      frames.push_back(std::move(*id));
  }
  if (error) return fail("cannot list keyframes", bundle.frames().string() + " (" + error.message() + ")");
  std::vector<std::string> order;
  if (const Result<Scan> scan = read_scan(bundle)) {
    for (const ScanPass& p : scan->passes) order.push_back(p.name);
  }
  const auto rank = [&](const std::string& pass) {
    return std::find(order.begin(), order.end(), pass) - order.begin();
  };
  std::sort(frames.begin(), frames.end(), [&](const FrameId& a, const FrameId& b) {
    return std::make_tuple(rank(a.pass), a) < std::make_tuple(rank(b.pass), b);
  });
  return frames;
}

}  // namespace gyre
