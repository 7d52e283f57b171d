// SPDX-License-Identifier: Apache-2.0
#include "offload/body/landmark_set.h"

#include "common/bundle/atomic_file.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

namespace gyre {

namespace {

using nlohmann::json;

constexpr double degrees = 180.0 / std::numbers::pi;
constexpr double farthest = 1e3;  // metres; a number beyond is a mistake
constexpr const char* remedy = "run the stage landmarks again";

tl::unexpected<Error> bad(const std::string& what, const std::string& where) {
  return fail(what, where, remedy);
}

// A list of `count` finite numbers within +-`limit`.
Result<Eigen::VectorXd> numbers(const json& parent, const char* key, Eigen::Index count, double limit,
                                const std::string& where) {
  const auto it = parent.find(key);
  if (it == parent.end() || !it->is_array() || static_cast<Eigen::Index>(it->size()) != count)
    return bad(std::string("a landmark needs ") + std::to_string(count) + " numbers as " + key, where);
  Eigen::VectorXd values(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const json& value = (*it)[static_cast<std::size_t>(i)];
    if (!value.is_number() || !(std::abs(value.get<double>()) <= limit))
      return bad(std::string("not a number, or out of bounds, in ") + key, where);
    values[i] = value.get<double>();
  }
  return values;
}

Result<std::vector<std::string>> texts(const json& parent, const char* key, const std::string& where) {
  std::vector<std::string> list;
  const auto it = parent.find(key);
  if (it == parent.end() || !it->is_array()) return bad(std::string("no list of ") + key, where);
  for (const json& text : *it) {
    if (!text.is_string()) return bad(std::string("not a text in ") + key, where);
    list.push_back(text.get<std::string>());
  }
  return list;
}

Result<PlacedLandmark> placed_from_json(const std::string& name, const json& j) {
  if (name.empty()) return bad("a landmark without a name", "landmarks.json");
  if (!j.is_object()) return bad("a landmark is not an object", name);
  PlacedLandmark mark;
  mark.name = name;
  const auto position = numbers(j, "position", 3, farthest, name);
  if (!position) return tl::unexpected(position.error());
  mark.position = *position;
  const auto covariance = numbers(j, "covariance", 9, farthest * farthest, name);
  if (!covariance) return tl::unexpected(covariance.error());
  mark.covariance = Eigen::Map<const Eigen::Matrix3d>(covariance->data());
  const double size = mark.covariance.cwiseAbs().maxCoeff();
  if ((mark.covariance - mark.covariance.transpose()).cwiseAbs().maxCoeff() > 1e-9 * size)
    return bad("the covariance is not symmetric", name);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(mark.covariance, Eigen::EigenvaluesOnly);
  if (!(spread.eigenvalues()[0] >= -1e-9 * size)) return bad("the covariance is not positive", name);
  const auto source = j.find("source");
  if (source == j.end() || !source->is_string()) return bad("a landmark without a source", name);
  mark.source = source->get<std::string>();
  if (mark.source != "geometric" && mark.source != "network" && mark.source != "picked")
    return bad("unknown source of a landmark", name + " from " + mark.source);
  const auto views = texts(j, "views", name);
  if (!views) return tl::unexpected(views.error());
  mark.views = *views;
  return mark;
}

Result<void> read_facing(const json& facing, LandmarkSet& set) {
  if (!facing.is_object()) return bad("no facing", "landmarks.json");
  const auto yaw = facing.find("yaw_deg");
  if (yaw == facing.end() || !(yaw->is_null() || yaw->is_number())) return bad("no yaw_deg", "facing");
  if (yaw->is_number()) {
    if (!(std::abs(yaw->get<double>()) <= 360)) return bad("yaw_deg is out of bounds", "facing");
    set.yaw = yaw->get<double>() / degrees;
  }
  const auto certainty = facing.find("certainty");
  if (certainty == facing.end() || !certainty->is_number() || !(certainty->get<double>() >= 0) ||
      !(certainty->get<double>() <= 1))
    return bad("the certainty is not a number from 0 to 1", "facing");
  set.yaw_certainty = certainty->get<double>();
  const auto reasons = texts(facing, "reasons", "facing");
  if (!reasons) return tl::unexpected(reasons.error());
  set.yaw_reasons = *reasons;
  return {};
}

}  // namespace

const PlacedLandmark* LandmarkSet::find(std::string_view name) const {
  const auto it = std::find_if(placed.begin(), placed.end(), [&](const PlacedLandmark& l) { return l.name == name; });
  return it == placed.end() ? nullptr : &*it;
}

const std::vector<std::string>& landmark_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all = {"crown",    "sellion", "noseTip", "noseBase", "upperLip",
                                    "lowerLip", "chin",    "navel",   "crotch"};
    for (const char* part :
         {"EyeInner", "EyeOuter",  "UpperLid", "LowerLid", "MouthCorner", "Nostril",  "Ear",      "EarLobe",
          "JawAngle", "Jaw",       "Shoulder", "Elbow",    "Wrist",       "ThumbTip", "IndexTip", "Fingertip",
          "RingTip",  "LittleTip", "Nipple",   "Knee",     "Ankle",       "Heel",     "Toe"}) {
      all.push_back(std::string("left") + part);
      all.push_back(std::string("right") + part);
    }
    return all;
  }();
  return names;
}

json to_json(const LandmarkSet& set) {
  json landmarks = json::object();
  for (const PlacedLandmark& mark : set.placed) {
    landmarks[mark.name] = {{"position", {mark.position.x(), mark.position.y(), mark.position.z()}},
                            {"covariance", std::vector<double>(mark.covariance.data(), mark.covariance.data() + 9)},
                            {"source", mark.source},
                            {"views", mark.views}};
  }
  return {{"version", 1},
          {"landmarks", landmarks},
          {"missing", set.missing},
          {"facing",
           {{"yaw_deg", set.yaw ? json(*set.yaw * degrees) : json()},
            {"certainty", set.yaw_certainty},
            {"reasons", set.yaw_reasons}}}};
}

Result<LandmarkSet> landmarks_from_json(const json& j) {
  if (!j.is_object()) return bad("landmarks are not a JSON object", "landmarks.json");
  const auto version = j.find("version");
  if (version == j.end() || *version != 1) return bad("unknown version of landmarks", "landmarks.json");
  LandmarkSet set;
  const auto landmarks = j.find("landmarks");
  if (landmarks == j.end() || !landmarks->is_object()) return bad("no landmarks", "landmarks.json");
  for (const auto& [name, value] : landmarks->items()) {
    auto mark = placed_from_json(name, value);
    if (!mark) return tl::unexpected(mark.error());
    set.placed.push_back(std::move(*mark));
  }
  const auto missing = j.find("missing");
  if (missing == j.end() || !missing->is_object()) return bad("no list of what is missing", "landmarks.json");
  for (const auto& [name, reason] : missing->items()) {
    if (!reason.is_string()) return bad("a missing landmark without a reason", name);
    if (landmarks->contains(name)) return bad("a landmark is both placed and missing", name);
    set.missing[name] = reason.get<std::string>();
  }
  const auto facing = j.find("facing");
  if (facing == j.end()) return bad("no facing", "landmarks.json");
  if (const auto read = read_facing(*facing, set); !read) return tl::unexpected(read.error());
  return set;
}

Result<LandmarkSet> read_landmarks(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  auto set = landmarks_from_json(json::parse(*text, nullptr, false));
  if (!set) {
    Error error = set.error();
    error.where = file.string() + ": " + error.where;
    return tl::unexpected(error);
  }
  return set;
}

Result<void> write_landmarks(const LandmarkSet& set, const std::filesystem::path& file) {
  return write_file(file, to_json(set).dump(1) + "\n");
}

}  // namespace gyre
