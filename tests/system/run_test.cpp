// SPDX-License-Identifier: Apache-2.0
// gyre-device run as a service manager sees it.
#include "common/bundle/atomic_file.h"
#include "tests/system/programs.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <httplib.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

namespace gyre {
namespace {

namespace fs = std::filesystem;

class RunTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(pictures());
    for (int i = 0; i < 10; ++i)
      cv::imwrite((pictures() / (std::to_string(i) + ".jpg")).string(), cv::Mat(64, 96, CV_8UC3, cv::Scalar::all(99)));
  }
  fs::path pictures() const { return folder_.path() / "pictures"; }
  std::string at(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string log() const { return read_file(folder_.path() / "log").value_or(""); }
  // What it says once it waits for its operator.
  nlohmann::json ready(Running& rig) const {
    return nlohmann::json::parse(first_line(folder_.path() / "out", rig), nullptr, false);
  }

  TemporaryFolder folder_;
};

TEST_F(RunTest, StopsWhenItIsToldTo) {
  Running rig("gyre-device",
              {"run", "--camera", "replay:" + pictures().string(), "--spool", at("spool"), "--page", "off"},
              folder_.path() / "out", folder_.path() / "log");
  ready(rig);
  EXPECT_EQ(rig.stop(), 0) << log();
}

// What its page shows and does reaches the session and comes back.
TEST_F(RunTest, AScanIsTakenFromItsPage) {
  Running rig("gyre-device",
              {"run", "--camera", "replay:" + pictures().string(), "--spool", at("spool"), "--page", "127.0.0.1:0"},
              folder_.path() / "out", folder_.path() / "log");
  std::string url = ready(rig).at("page");
  url.pop_back();  // the slash at its end
  httplib::Client page(url);
  page.set_default_headers({{"X-Gyre", "1"}});
  // What it does after those states.
  const auto state_after = [&](const std::set<std::string>& before) {
    for (;;) {
      const auto status = page.Get("/api/status");
      if (!status || rig.ended()) return std::string("ended");
      const std::string state = nlohmann::json::parse(status->body).value("state", "");
      if (!before.contains(state)) return state;
    }
  };
  const auto command = [&](const std::string& name) {
    const auto answer = page.Post("/api/commands", nlohmann::json{{"command", name}}.dump(), "application/json");
    return answer ? answer->status : 0;
  };
  EXPECT_EQ(state_after({}), "idle") << log();
  EXPECT_EQ(page.Get("/health")->status, 200);
  EXPECT_NE(page.Get("/metrics")->body.find("# TYPE"), std::string::npos);
  EXPECT_EQ(page.Get("/api/preview.jpg")->status, 200);
  EXPECT_EQ(command("dance"), 400);
  EXPECT_EQ(command("start"), 200);
  EXPECT_EQ(state_after({"idle", "arming", "pass", "finishing"}), "between_passes") << log();
  EXPECT_EQ(rig.stop(), 0) << log();
  // The next start goes on with it.
  Running again("gyre-device",
                {"run", "--camera", "replay:" + pictures().string(), "--spool", at("spool"), "--page", "off"},
                folder_.path() / "out", folder_.path() / "again");
  const auto said_again = [&] { return read_file(folder_.path() / "again").value_or(""); };
  while (said_again().find("goes on") == std::string::npos) ASSERT_FALSE(again.ended()) << said_again();
  EXPECT_EQ(again.stop(), 0);
}

TEST_F(RunTest, GoesOnWithoutItsPanel) {
  ASSERT_TRUE(write_file(
      folder_.path() / "rig.toml",
      "[run]\ncamera = \"replay:" + pictures().string() + "\"\nspool = \"" + at("spool") +
          "\"\npage = \"127.0.0.1:0\"\n[panel]\nbutton = \"GYRE_NO_SUCH_BUTTON\"\nred = \"no-such-chip:3\"\n"));
  Running rig("gyre-device", {"--config", at("rig.toml"), "run"}, folder_.path() / "out", folder_.path() / "log");
  ready(rig);
  EXPECT_NE(log().find("going on without it"), std::string::npos) << log();
  EXPECT_EQ(rig.stop(), 0) << log();
}

TEST_F(RunTest, WrongUseIsToldApartFromWhatIsNotThere) {
  EXPECT_EQ(run_program("gyre-device", {"run", "--spool", at("spool")}).code, 2);
  EXPECT_EQ(run_program("gyre-device", {"run", "--camera", "film:x", "--spool", at("spool")}).code, 2);
  ASSERT_TRUE(write_file(folder_.path() / "rig.toml",
                         "[run]\ncamera = \"replay:x\"\nspool = \"" + at("spool") + "\"\n[panel]\nbutton = \"17\"\n"));
  const Finished numbered = run_program("gyre-device", {"--config", at("rig.toml"), "run"});
  EXPECT_EQ(numbered.code, 2);
  EXPECT_NE(numbered.err.find("not the name of a GPIO line"), std::string::npos) << numbered.err;
}

}  // namespace
}  // namespace gyre
