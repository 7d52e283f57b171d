// SPDX-License-Identifier: Apache-2.0
// Proof of what was deleted: it outlives what it speaks of.
#pragma once

#include "offload/store/store.h"

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

namespace gyre {

// {"deleted", "at", "device", "bytes", "files": [{"name", "size", "sha256"}]}
nlohmann::json to_json(const DeletionReceipt& receipt);

// Appends the receipt, with `why` it was deleted, as one line to <store>/receipts.jsonl, synced, and logs it.
Result<void> keep_receipt(const std::filesystem::path& store, const DeletionReceipt& receipt, std::string_view why);

}  // namespace gyre
