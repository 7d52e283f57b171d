// SPDX-License-Identifier: Apache-2.0
#include "device/camera/fault_script.h"

#include "common/bundle/atomic_file.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

using nlohmann::json;
constexpr int most_frames = 1'000'000;
constexpr double longest = 3600.0;  // seconds

constexpr std::array<std::pair<std::string_view, Fault::Kind>, 6> fault_kinds = {{{"late", Fault::Kind::late},
                                                                                  {"missing", Fault::Kind::missing},
                                                                                  {"torn", Fault::Kind::torn},
                                                                                  {"silence", Fault::Kind::silence},
                                                                                  {"broken", Fault::Kind::broken},
                                                                                  {"gone", Fault::Kind::gone}}};
constexpr std::array<std::pair<std::string_view, Fault::Until>, 3> fault_ends = {
    {{"restart", Fault::Until::restart}, {"reopen", Fault::Until::reopen}, {"never", Fault::Until::never}}};

template <class Table>
auto find_word(const Table& table, const json& entry, const char* key) {
  const auto word = entry.find(key);
  return word == entry.end() || !word->is_string() ? table.end()
                                                   : std::find_if(table.begin(), table.end(), [&](const auto& t) {
                                                       return t.first == word->template get_ref<const std::string&>();
                                                     });
}

bool counts_frames(Fault::Kind kind) {
  return kind == Fault::Kind::missing || kind == Fault::Kind::torn;
}

// The fault of an entry, or why it is none.
tl::expected<Fault, std::string> read_fault(const json& entry) {
  using Wrong = tl::unexpected<std::string>;
  if (!entry.is_object()) return Wrong("it is no object");
  Fault fault;
  const auto* const kind = find_word(fault_kinds, entry, "kind");
  if (kind == fault_kinds.end()) return Wrong("\"kind\" must be late, missing, torn, silence, broken or gone");
  fault.kind = kind->second;
  std::size_t known = 2;

  const auto whole = [&](const char* key, int least, int& number) {
    const auto found = entry.find(key);
    if (found == entry.end() || !found->is_number_integer()) return false;
    const auto value = found->get<std::int64_t>();
    number = static_cast<int>(std::clamp<std::int64_t>(value, -1, most_frames));
    return value >= least && value <= most_frames;
  };
  if (!whole("before_frame", 0, fault.before_frame)) return Wrong("\"before_frame\" must be a frame's number");
  if (counts_frames(fault.kind)) {
    if (entry.contains("frames")) {
      ++known;
      if (!whole("frames", 1, fault.frames)) return Wrong("\"frames\" must be a number of frames");
    }
  } else if (entry.contains("until")) {
    ++known;
    const auto* const end = find_word(fault_ends, entry, "until");
    if (end == fault_ends.end() || fault.kind == Fault::Kind::late)
      return Wrong("\"until\" must be restart, reopen or never");
    fault.until = end->second;
    if (fault.kind == Fault::Kind::gone && fault.until == Fault::Until::restart)
      return Wrong("a device that is gone cannot be restarted: \"until\" must be reopen or never");
  } else {
    ++known;
    const auto seconds = entry.find("seconds");
    if (seconds != entry.end() && seconds->is_number()) fault.seconds = seconds->get<double>();
    if (!(fault.seconds > 0.0 && fault.seconds <= longest))
      return Wrong("\"seconds\" must be more than 0 and at most 3600" +
                   std::string(fault.kind == Fault::Kind::late ? "" : ", or \"until\" must say what ends it"));
  }
  if (entry.size() != known) return Wrong("it has entries that mean nothing for this kind");
  return fault;
}

}  // namespace

Result<std::vector<Fault>> parse_fault_script(std::string_view text) {
  const json script = json::parse(text, nullptr, false);
  if (script.is_discarded()) return wrong_use("the fault script is no JSON");
  const auto list = script.is_object() ? script.find("faults") : script.end();
  if (!script.is_object() || script.size() != 1 || list == script.end() || !list->is_array())
    return wrong_use("the fault script must be an object with a list \"faults\" and nothing else");
  std::vector<Fault> faults;
  for (const json& entry : *list) {
    const auto fault = read_fault(entry);
    const std::string which = "fault " + std::to_string(faults.size() + 1);
    if (!fault) return wrong_use("the fault script has a wrong entry", which, fault.error());
    if (!faults.empty() && fault->before_frame <= faults.back().before_frame)
      return wrong_use("the fault script has a wrong entry", which, "faults must be in the order of their frames");
    faults.push_back(*fault);
  }
  return faults;
}

Result<std::vector<Fault>> read_fault_script(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  Result<std::vector<Fault>> faults = parse_fault_script(*text);
  if (!faults) faults.error().where = file.string() + (faults.error().where.empty() ? "" : ", " + faults.error().where);
  return faults;
}

}  // namespace gyre
