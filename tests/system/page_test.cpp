// SPDX-License-Identifier: Apache-2.0
// The pages of host and rig in a real browser: from a recording, and from a press on the rig's page, to an avatar.
#include "common/bundle/atomic_file.h"
#include "tests/system/programs.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Share of pixels that differ by more than noise.
double changed(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size()) return 1.0;
  cv::Mat difference;
  cv::absdiff(a, b, difference);
  cv::cvtColor(difference, difference, cv::COLOR_BGR2GRAY);
  return static_cast<double>(cv::countNonZero(difference > 12)) / static_cast<double>(difference.total());
}

void make_capture(const std::string& folder) {
  ASSERT_EQ(run_program("synthetic_capture",
                        {folder, "--sequence", "orbit-body", "--frames", "90", "--width", "270", "--height", "480"})
                .code,
            0);
}

TEST(Page, ARecordingBecomesAnAvatarThatIsUsedDownloadedAndDeleted) {
  const TemporaryFolder folder;
  const fs::path root = folder.path();
  const std::string capture = (root / "capture").string(), seen_folder = (root / "seen").string();
  fs::create_directories(seen_folder);
  fs::create_directories(root / "host");
  ASSERT_NO_FATAL_FAILURE(make_capture(capture));
  Running host("gyre-offload",
               {"serve", "--store", (root / "host").string(), "--endpoint", "tcp://127.0.0.1:*", "--page",
                "127.0.0.1:0", "--texture-size", "1024"},
               root / "ready.json", root / "host.log");
  const json ready = json::parse(first_line(root / "ready.json", host));

  const Finished browsed = run_program("/usr/bin/env", {"node", GYRE_SYSTEM_TESTS "/page_browse.mjs", "walk",
                                                        ready.at("page"), seen_folder, capture + "/video.mp4", "1700"});
  ASSERT_EQ(browsed.code, 0) << browsed.err << "\n('./dev setup --all' installs the browser)\n"
                             << read_file(root / "host.log").value_or("");
  const json seen = json::parse(browsed.out);

  EXPECT_EQ(seen.at("phases").back(), "done") << seen.dump(1);
  EXPECT_EQ(seen.at("complaints"), json::array());
  for (const auto& [view, faults] : seen.at("faults").items()) EXPECT_EQ(faults, json::array()) << view;
  EXPECT_GE(seen.at("expressions"), 52);
  EXPECT_FALSE(seen.at("phone_is_wide"));
  for (const char* name : {"avatar.glb", "avatar.vrm", "avatar.fbx", "report.html", "report.json"}) {
    EXPECT_GT(seen.at("downloads").value(name, 0), 1000) << name;
  }
  EXPECT_EQ(read_file(fs::path(seen_folder) / "avatar.glb").value().substr(0, 4), "glTF");
  const json again = seen.at("after_run_again");
  EXPECT_NE(std::find(again.begin(), again.end(), "avatar-50.glb"), again.end()) << again;
  EXPECT_FALSE(fs::exists(root / "host" / "scans" / seen.at("scan").get<std::string>()));

  // There is a person in the picture, and every control changes what is seen of them.
  const auto picture = [&](const std::string& name) { return cv::imread(seen_folder + "/" + name + ".png"); };
  const cv::Mat avatar = picture("avatar");
  ASSERT_FALSE(avatar.empty());
  const cv::Mat empty(avatar.size(), avatar.type(), cv::Scalar(avatar.at<cv::Vec3b>(2, 2)));
  EXPECT_GT(changed(avatar, empty), 0.05);
  EXPECT_GT(changed(picture("face"), picture("jaw")), 0.002);
  for (const char* name : {"face", "wave", "skeleton", "sources"}) {
    EXPECT_GT(changed(avatar, picture(name)), 0.002) << name;
  }
  EXPECT_EQ(host.stop(), 0);
}

TEST(Page, AScanIsTakenOnAPhoneAndItsAvatarComesBackToTheRig) {
  const TemporaryFolder folder;
  const fs::path root = folder.path();
  const std::string capture = (root / "capture").string(), seen_folder = (root / "seen").string();
  const std::string store = (root / "host").string(), keys = (root / "keys").string();
  fs::create_directories(seen_folder);
  fs::create_directories(store);
  ASSERT_NO_FATAL_FAILURE(make_capture(capture));
  Running host(
      "gyre-offload",
      {"serve", "--store", store, "--endpoint", "tcp://127.0.0.1:*", "--page", "off", "--texture-size", "1024"},
      root / "ready.json", root / "host.log");
  const json ready = json::parse(first_line(root / "ready.json", host));
  const Finished known =
      run_program("gyre-device", {"pair", "--keys", keys, "--host-public-key", ready.at("public_key")});
  ASSERT_EQ(known.code, 0) << known.err;
  const std::string key = json::parse(known.out).at("device_public_key");
  ASSERT_EQ(run_program("gyre-offload", {"pair", "--store", store, "--authorise", key, "--name", "rig-1"}).code, 0);

  Running rig("gyre-device",
              {"run", "--camera", "replay:" + capture + "/video.mp4", "--spool", (root / "spool").string(), "--host",
               ready.at("endpoint"), "--keys", keys, "--name", "rig-1", "--page", "127.0.0.1:0"},
              root / "rig.out", root / "rig.log");
  const auto log = [&] { return read_file(root / "rig.log").value_or(""); };
  const std::string url = json::parse(first_line(root / "rig.out", rig)).at("page");
  const Finished browsed = run_program("/usr/bin/env", {"node", GYRE_SYSTEM_TESTS "/rig_browse.mjs", url, seen_folder});
  ASSERT_EQ(browsed.code, 0) << browsed.err << log();
  const json seen = json::parse(browsed.out);
  EXPECT_EQ(seen.at("complaints"), json::array());
  for (const auto& [view, faults] : seen.at("faults").items()) EXPECT_EQ(faults, json::array()) << view;
  EXPECT_FALSE(seen.at("is_wide"));
  EXPECT_EQ(seen.at("between"), "between_passes");
  EXPECT_EQ(seen.at("scans"), 1);
  const json results = seen.at("results");
  EXPECT_NE(std::find(results.begin(), results.end(), "avatar.glb"), results.end()) << results;
  EXPECT_EQ(rig.stop(), 0) << log();
  EXPECT_EQ(host.stop(), 0);
}

}  // namespace
}  // namespace gyre
