// SPDX-License-Identifier: Apache-2.0
#include "device/camera/camera_name.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <vector>

namespace gyre {

namespace {

constexpr std::array<std::pair<std::string_view, CameraName::Kind>, 3> camera_kinds = {
    {{"replay:", CameraName::Kind::replay},
     {"v4l2:", CameraName::Kind::v4l2},
     {"libcamera:", CameraName::Kind::libcamera}}};
constexpr int largest_side = 16384;
constexpr int most_buffers = 8;

struct Setting {
  std::string_view key;
  std::string_view value;
};

// The settings behind the last question mark, "key=value&key=value"; none when the text there is something else.
std::vector<Setting> take_settings(std::string_view& text) {
  std::vector<Setting> settings;
  const std::size_t mark = text.rfind('?');
  if (mark == std::string_view::npos) return settings;
  std::string_view rest = text.substr(mark + 1);
  const auto is_key = [](std::string_view key) {
    return !key.empty() && std::all_of(key.begin(), key.end(), [](char c) { return c >= 'a' && c <= 'z'; });
  };
  for (;;) {
    const std::size_t end = rest.find('&');
    const std::string_view part = rest.substr(0, end);
    const std::size_t equals = part.find('=');
    if (equals == std::string_view::npos || !is_key(part.substr(0, equals))) return {};
    settings.push_back({part.substr(0, equals), part.substr(equals + 1)});
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
  }
  text = text.substr(0, mark);
  return settings;
}

bool parse_number(std::string_view text, int least, int most, int& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() && number >= least && number <= most;
}

bool apply(const Setting& setting, CameraName& name) {
  const auto [key, value] = setting;
  if (name.kind == CameraName::Kind::replay) {
    name.faults = value;
    return key == "faults" && !value.empty();
  }
  if (key == "buffers") return parse_number(value, 1, most_buffers, name.buffers);
  if (key == "size") {
    const std::size_t by = value.find('x');
    return by != std::string_view::npos && parse_number(value.substr(0, by), 1, largest_side, name.width) &&
           parse_number(value.substr(by + 1), 1, largest_side, name.height);
  }
  name.format = value;
  return name.kind == CameraName::Kind::v4l2 && key == "format" &&
         (value == "MJPG" || value == "NV12" || value == "YUYV");
}

}  // namespace

Result<CameraName> parse_camera_name(std::string_view text) {
  const std::string whole(text);
  const auto kind =
      std::find_if(camera_kinds.begin(), camera_kinds.end(), [&](const auto& k) { return text.starts_with(k.first); });
  if (kind == camera_kinds.end())
    return wrong_use("no such camera", whole, "give replay:PATH, v4l2:DEVICE, libcamera: or libcamera:ID");
  text.remove_prefix(kind->first.size());
  CameraName name{.kind = kind->second};
  for (const Setting& setting : take_settings(text)) {
    if (apply(setting, name)) continue;
    return wrong_use("a setting this kind of camera does not have, or an impossible value",
                     std::string(setting.key) + "=" + std::string(setting.value) + " in " + whole,
                     name.kind == CameraName::Kind::replay
                         ? "a replay has faults=FILE"
                         : "there are size=WIDTHxHEIGHT, buffers=1 to 8, and for v4l2 "
                           "format=MJPG, NV12 or YUYV");
  }
  name.target = text;
  if (!take_settings(text).empty()) return wrong_use("settings of a camera twice", whole, "join them with &");
  if (name.target.empty() && name.kind != CameraName::Kind::libcamera)
    return wrong_use("the camera has no name", whole,
                     name.kind == CameraName::Kind::replay ? "give replay:PATH with a video or a folder of pictures"
                                                           : "give v4l2:DEVICE, as v4l2:/dev/video0");
  return name;
}

std::string to_string(const CameraName& name) {
  const CameraName defaults;
  const auto kind =
      std::find_if(camera_kinds.begin(), camera_kinds.end(), [&](const auto& k) { return k.second == name.kind; });
  std::string text = std::string(kind->first) + name.target;
  char separator = '?';
  const auto add = [&](std::string_view key, const std::string& value) {
    text.push_back(std::exchange(separator, '&'));
    text.append(key).append("=").append(value);
  };
  if (!name.faults.empty()) add("faults", name.faults);
  if (name.width != 0) add("size", std::to_string(name.width) + "x" + std::to_string(name.height));
  if (!name.format.empty()) add("format", name.format);
  if (name.buffers != defaults.buffers) add("buffers", std::to_string(name.buffers));
  return text;
}

}  // namespace gyre
