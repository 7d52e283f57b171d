// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/recording.h"

#include "common/selection/ingest.h"

namespace gyre {

Result<Scan> scan_of_recordings(const std::vector<Recording>& recordings, const Bundle& bundle, Scan scan,
                                const Progress& progress, const std::atomic<bool>& cancel) {
  std::error_code error;
  std::filesystem::remove_all(bundle.frames(), error);
  scan.software = GYRE_VERSION;
  scan.passes.clear();
  if (const Result<Bundle> made = create_bundle(bundle.root(), scan); !made) return tl::unexpected(made.error());
  std::vector<FrameRecord> records;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const Recording& recording = recordings[i];
    const auto share = [&](double fraction, std::string_view what) {
      progress((static_cast<double>(i) + fraction) / static_cast<double>(recordings.size()), what);
    };
    const Result<IngestedPass> pass = ingest_capture(recording.capture, recording.pass, bundle,
                                                     SelectionOptions::for_pass(recording.pass), share, cancel);
    if (!pass) return tl::unexpected(pass.error());
    scan.passes.push_back(pass->pass);
    records.insert(records.end(), pass->records.begin(), pass->records.end());
  }
  if (const Result<void> logged = write_frame_log(bundle, records); !logged) return tl::unexpected(logged.error());
  if (const Result<void> written = write_scan(bundle, scan); !written) return tl::unexpected(written.error());
  return scan;
}

}  // namespace gyre
