// SPDX-License-Identifier: Apache-2.0
// What the page is told of scans, as JSON; offload/page/web/model.ts has the same shapes.
#pragma once

#include "common/bundle/stage.h"
#include "offload/ingest/link_board.h"
#include "offload/store/store.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

// What is being done to a scan just now.
struct ScanActivity {
  std::string stage;
  double fraction = 0.0;
  std::string text;
};

// Results that the page hands out when they are there.
const std::vector<std::string>& result_names();
// Where one of them lies.
std::filesystem::path result_file(const Bundle& bundle, const std::string& name);

// A line of the list. importing: its keyframes are being selected from an upload. device: that the scan comes from,
// when it is known.
nlohmann::json scan_row(const Store& store, const StoredScan& scan, const std::optional<ScanActivity>& work,
                        bool importing, const std::optional<DeviceView>& device);

// A device as the page shows it: {"name", "connected", "since", "status", "coverage"}, the last two null when not told.
nlohmann::json device_row(const DeviceView& device);

// The row with stature, stages, options and warnings. stages: in the order they run.
nlohmann::json scan_details(const Store& store, const nlohmann::json& row, const std::string& id,
                            const std::vector<Stage>& stages);

// Checks changes to options that somebody wants a scan run again with: {"stage": {"option": value, or null for the
// default}}. Errors (wrong use): an
// unknown stage or option, a value of another type than the default, or an option that names a file of this machine.
Result<void> check_page_options(const nlohmann::json& options, const std::vector<Stage>& stages);

}  // namespace gyre
