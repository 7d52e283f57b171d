// SPDX-License-Identifier: Apache-2.0
#include "common/metrics/metrics.h"

#include <array>
#include <cassert>
#include <charconv>
#include <cmath>

namespace gyre {

namespace {

[[maybe_unused]] bool is_metric_name(std::string_view name) {
  if (name.empty() || (name[0] >= '0' && name[0] <= '9')) return false;
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
  return name.find_first_not_of(letters) == std::string_view::npos;
}

// quotes: also escapes them, as values of labels need it and help texts do not.
std::string escaped(std::string_view text, bool quotes) {
  std::string out;
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
      continue;
    }
    if (c == '\\' || (quotes && c == '"')) out += '\\';
    out += c;
  }
  return out;
}

std::string text_of(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end.ptr};
}

void append_sample(std::string& out, const std::string& name, const MetricSample& sample) {
  out += name;
  char before = '{';
  for (const auto& [label, value] : sample.labels) {
    assert(is_metric_name(label));
    out += before + label + "=\"" + escaped(value, true) + '"';
    before = ',';
  }
  if (before == ',') out += '}';
  out += ' ' + text_of(sample.value) + '\n';
}

Metrics::ReadAll all_of(Metrics::ReadOne read) {
  return [read = std::move(read)] { return std::vector<MetricSample>{{{}, read()}}; };
}

}  // namespace

void Metrics::counter(const std::string& name, const std::string& help, ReadOne read) {
  add(name, help, "counter", all_of(std::move(read)));
}
void Metrics::counter(const std::string& name, const std::string& help, ReadAll read) {
  add(name, help, "counter", std::move(read));
}
void Metrics::gauge(const std::string& name, const std::string& help, ReadOne read) {
  add(name, help, "gauge", all_of(std::move(read)));
}
void Metrics::gauge(const std::string& name, const std::string& help, ReadAll read) {
  add(name, help, "gauge", std::move(read));
}

void Metrics::add(const std::string& name, const std::string& help, const char* type, ReadAll read) {
  assert(is_metric_name(name));
  families_.push_back({name, help, type, std::move(read)});
}

std::string Metrics::expose() const {
  std::string out;
  for (const Family& family : families_) {
    out += "# HELP " + family.name + ' ' + escaped(family.help, false) + '\n';
    out += "# TYPE " + family.name + ' ' + family.type + '\n';
    for (const MetricSample& sample : family.read()) append_sample(out, family.name, sample);
  }
  return out;
}

}  // namespace gyre
