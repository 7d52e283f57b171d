// SPDX-License-Identifier: Apache-2.0
#include "device/page/status_text.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace gyre {

namespace {

using nlohmann::json;

// What a page of another version lacks counts as nothing.
std::string text_of(const json& object, const char* name) {
  const json value = object.is_object() ? object.value(name, json()) : json();
  return value.is_string() ? value.get<std::string>() : "";
}

double number_of(const json& object, const char* name) {
  const json value = object.is_object() ? object.value(name, json()) : json();
  return value.is_number() ? value.get<double>() : 0.0;
}

json list_of(const json& object, const char* name) {
  json value = object.is_object() ? object.value(name, json()) : json();
  return value.is_array() ? value : json::array();
}

std::string percent(double fraction) {
  return std::to_string(std::lround(100.0 * fraction)) + " %";
}

void line(std::ostringstream& out, std::string label, const std::string& text) {
  constexpr std::size_t width = 10;
  if (text.empty()) return;
  label.resize(std::max(label.size(), width), ' ');
  out << label << text << "\n";
}

void add_coverage(std::ostringstream& out, const json& status) {
  constexpr std::size_t width = 12;
  bool is_first = true;
  for (const json& band : list_of(status, "coverage")) {
    std::string name = text_of(band, "band");
    const std::string cells = text_of(band, "cells");
    name.resize(std::max(name.size(), width), ' ');
    std::string share = "  " + std::to_string(std::ranges::count(cells, '#'));
    if (band.is_object() && band.value("is_ring", json()) == true) share += " of " + std::to_string(cells.size());
    line(out, is_first ? "coverage" : "", name + cells + share);
    is_first = false;
  }
}

void add_live(std::ostringstream& out, const json& status) {
  std::string state = text_of(status, "state");
  std::ranges::replace(state, '_', ' ');
  const std::string pass = text_of(status, "pass");
  line(out, "rig", state + (pass.empty() ? "" : ", pass " + pass));
  const std::string sentence = text_of(status.value("signal", json()), "sentence");
  line(out, "do", sentence);
  line(out, "fault", text_of(status, "fault"));
  line(out, "notice", text_of(status, "notice"));
  for (const json& condition : list_of(status, "conditions")) {
    if (text_of(condition, "sentence") != sentence) line(out, "also", text_of(condition, "sentence"));
  }
  add_coverage(out, status);
  const auto count = [&](const char* name) { return std::to_string(std::lround(number_of(status, name))); };
  line(out, "frames",
       count("frames") + " at " + count("frames_per_second") + " a second, " + count("keyframes") + " kept, " +
           count("acknowledged") + " at the host");
  line(out, "disk", count("disk_free_mib") + " MiB free");
  const json host = status.value("host", json());
  line(out, "host", text_of(host, "text"));
  if (const std::string stage = text_of(host, "stage"); !stage.empty()) {
    line(out, "", stage + " " + percent(number_of(host, "fraction")));
  }
}

std::string scan_line(const json& scan) {
  constexpr std::size_t width = 13;
  std::string phase = text_of(scan, "phase");
  phase.resize(std::max(phase.size(), width), ' ');
  std::string text = text_of(scan, "id") + "  " + phase + std::to_string(std::lround(number_of(scan, "acknowledged"))) +
                     " of " + std::to_string(std::lround(number_of(scan, "files"))) + " files on the host";
  if (const std::string stage = text_of(scan, "stage"); !stage.empty()) {
    text += ", " + stage + " " + percent(number_of(scan, "fraction"));
  }
  if (const std::string reason = text_of(scan, "reason"); !reason.empty()) text += ": " + reason;
  return text;
}

}  // namespace

std::string status_text(const json& status, const json& scans, std::size_t most_scans) {
  std::ostringstream out;
  if (status.is_object()) {
    add_live(out, status);
  } else {
    line(out, "rig", "not running");
  }
  if (!scans.is_array()) return out.str();
  for (std::size_t i = 0; i < std::min(scans.size(), most_scans); ++i) {
    line(out, i == 0 ? "scans" : "", scan_line(scans[i]));
  }
  if (scans.size() > most_scans) line(out, "", "and " + std::to_string(scans.size() - most_scans) + " older ones");
  return out.str();
}

}  // namespace gyre
