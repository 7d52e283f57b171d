// SPDX-License-Identifier: Apache-2.0
#include "device/page/scan_rows.h"

#include <algorithm>

namespace gyre {

namespace {

using nlohmann::json;

constexpr std::string_view frames_folder = "frames/";

}  // namespace

json scan_row(const SpooledScan& scan, const LiveStatus& now) {
  int files = 0;
  int acknowledged = 0;
  int keyframes = 0;
  std::string cover;
  for (const SpooledFile& file : scan.files) {
    if (file.phase == SpooledFilePhase::discarded) continue;
    ++files;
    if (file.phase == SpooledFilePhase::acknowledged) ++acknowledged;
    if (!file.name.starts_with(frames_folder)) continue;
    ++keyframes;
    if (cover.empty()) cover = file.name.substr(frames_folder.size());
  }
  json results = json::array();
  for (const SpooledFile& result : scan.results) results.push_back(result.name);
  const bool is_waited_for = scan.id == now.scan;
  return {{"id", scan.id},
          {"phase", name_of(scan.phase)},
          {"reason", scan.reason},
          {"keyframes", keyframes},
          {"files", files},
          {"acknowledged", acknowledged},
          {"cover", cover},
          {"results", std::move(results)},
          {"stage", is_waited_for ? now.host.stage : ""},
          {"fraction", is_waited_for ? now.host.fraction : 0.0}};
}

json scan_rows(const Spool& spool, const LiveStatus& now) {
  json rows = json::array();
  std::vector<std::string> ids = spool.scan_ids();
  std::reverse(ids.begin(), ids.end());
  for (const std::string& id : ids) {
    if (const std::optional<SpooledScan> scan = spool.scan(id)) rows.push_back(scan_row(*scan, now));
  }
  return rows;
}

}  // namespace gyre
