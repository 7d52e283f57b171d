// SPDX-License-Identifier: Apache-2.0
#include "tests/system/spool_view.h"

#include "common/bundle/bundle.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"
#include "device/spool/journal.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <set>

namespace gyre {

namespace {

namespace fs = std::filesystem;

// The journal of a scan, from a copy, as opening one repairs it.
std::optional<SpooledScan> read_journal(const fs::path& folder) {
  const TemporaryFolder copy;
  std::error_code error;
  fs::copy_file(folder / "spool.jsonl", copy.path() / "spool.jsonl", error);
  if (error) return std::nullopt;
  std::vector<SpoolEvent> events;
  const Result<SpoolJournal> journal = SpoolJournal::open(copy.path() / "spool.jsonl", events);
  EXPECT_TRUE(journal) << journal.error().message();
  if (events.empty() || events.front().kind != SpoolEvent::Kind::opened) return std::nullopt;
  SpooledScan scan;
  scan.id = folder.filename().string();
  for (std::size_t i = 1; i < events.size(); ++i) {
    const Result<void> applied = apply(scan, events[i]);
    EXPECT_TRUE(applied) << applied.error().message();
  }
  return scan;
}

SpoolView::Files frames_of(const SpoolView& view, const std::set<SpooledFilePhase>& phases) {
  SpoolView::Files files;
  for (const auto& [id, scan] : view.scans) {
    for (const SpooledFile& file : scan.files) {
      if (file.name.starts_with("frames/") && phases.contains(file.phase)) files[id + "/" + file.name] = file.sha256;
    }
  }
  return files;
}

std::string pass_of(const std::string& file) {
  const std::optional<FrameId> id = parse_frame_name(fs::path(file).filename().string());
  return id ? id->pass : std::string();
}

}  // namespace

SpoolView::Files SpoolView::keyframes() const {
  return frames_of(*this, {SpooledFilePhase::spooled, SpooledFilePhase::acknowledged});
}

SpoolView::Files SpoolView::acknowledged() const {
  return frames_of(*this, {SpooledFilePhase::acknowledged});
}

SpoolView view_spool(const fs::path& spool) {
  SpoolView view;
  std::error_code error;
  for (auto it = fs::directory_iterator(spool, error); !error && it != fs::directory_iterator(); it.increment(error)) {
    if (!is_ulid(it->path().filename().string())) continue;
    if (std::optional<SpooledScan> scan = read_journal(it->path())) view.scans[scan->id] = std::move(*scan);
  }
  view.session = SessionStore(spool).load();
  return view;
}

void expect_whole(const SpoolView::Files& keyframes, const fs::path& scans) {
  for (const auto& [name, hash] : keyframes) EXPECT_EQ(sha256_of_file(scans / name).value_or("missing"), hash) << name;
}

void expect_tidy(const SpoolView& view, const fs::path& spool) {
  const SpoolView::Files keyframes = view.keyframes();
  expect_whole(keyframes, spool);
  for (const auto& entry : fs::recursive_directory_iterator(spool)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = fs::relative(entry.path(), spool).string();
    const std::string extension = entry.path().extension().string();
    // What comes from the host is collected in a .part until it is whole.
    EXPECT_TRUE(extension == ".part" || !extension.starts_with(".part")) << name;
    const bool is_frame = !pass_of(name).empty();
    EXPECT_TRUE(!is_frame || keyframes.contains(name)) << name;
  }
  for (const auto& [id, scan] : view.scans) {
    if (scan.phase == SpoolPhase::recording) {
      EXPECT_TRUE(view.session && view.session->scan && view.session->scan->id == id) << id << " is left open";
      continue;
    }
    const Result<void> verified = verify_bundle(Bundle(spool / id));
    EXPECT_TRUE(verified) << verified.error().message();
    for (const SpooledFile& file : scan.results) {
      EXPECT_EQ(sha256_of_file(spool / id / file.name).value_or("missing"), file.sha256) << file.name;
    }
  }
}

void expect_explained(const SpoolView& before, const SpoolView& after, const std::string& log) {
  const SpoolView::Files had = before.keyframes(), has = after.keyframes();
  std::map<std::string, int> taken;  // keyframes by scan and pass
  for (const auto& [name, hash] : had) {
    const auto there = has.find(name);
    if (there == has.end()) {
      ++taken[name.substr(0, name.find('/')) + ": its pass " + pass_of(name)];
    } else {
      EXPECT_EQ(there->second, hash) << name;
    }
  }
  EXPECT_LE(has.size(), had.size());
  for (const auto& [pass, count] : taken) {
    const std::string reason = pass + " was cut off with " + std::to_string(count) + " keyframes, too few";
    EXPECT_NE(log.find(reason), std::string::npos) << "lost: " << count << " keyframes of " << pass << "\n" << log;
  }
  if (!before.session || !before.session->scan || before.session->state == SessionState::idle) return;
  const std::string scan = "scan " + before.session->scan->id;
  const auto is_said = [&](const std::string& what) { return log.find(scan + what) != std::string::npos; };
  EXPECT_TRUE(is_said(" was " + std::string(name_of(before.session->state)) + " when the device stopped")) << log;
  const bool is_open =
      before.session->state != SessionState::waiting_for_host && before.session->state != SessionState::avatar_ready;
  if (is_open) {
    EXPECT_TRUE(is_said(" goes on: pass ") || is_said(" was cut off and is closed with what it has") ||
                is_said(" had nothing recorded") ||
                taken.contains(before.session->scan->id + ": its pass " + before.session->pass))
        << log;
  }
}

int expect_delivered(const SpoolView& view, const SpoolView::Files& acknowledged, const fs::path& scans) {
  int delivered = 0;
  for (const auto& [id, scan] : view.scans) {
    SCOPED_TRACE("scan " + id + " is " + std::string(name_of(scan.phase)));
    if (scan.phase == SpoolPhase::recording) continue;  // all of it was taken back; its name serves the next one
    ++delivered;
    EXPECT_EQ(scan.phase, SpoolPhase::delivered);
    const Result<void> verified = verify_bundle(Bundle(scans / id));
    EXPECT_TRUE(verified) << verified.error().message();
  }
  const SpoolView::Files keyframes = view.keyframes();
  expect_whole(keyframes, scans);
  EXPECT_EQ(keyframes, view.acknowledged());
  for (const auto& [name, hash] : acknowledged) {
    const std::string id = name.substr(0, name.find('/'));
    const auto scan = view.scans.find(id);
    const SpooledFile* const file =
        scan == view.scans.end() ? nullptr : find_file(scan->second.files, name.substr(id.size() + 1));
    EXPECT_TRUE(file != nullptr && (file->phase == SpooledFilePhase::discarded || file->sha256 == hash)) << name;
  }
  return delivered;
}

}  // namespace gyre
