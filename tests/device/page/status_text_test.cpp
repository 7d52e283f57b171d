// SPDX-License-Identifier: Apache-2.0
#include "device/page/status_text.h"

#include "device/page/scan_rows.h"
#include "device/page/status_view.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using nlohmann::json;

LiveStatus walking() {
  LiveStatus status;
  status.state = SessionState::pass;
  status.pass = "body";
  status.signal = signal_of(Condition::too_fast);
  status.conditions.set(static_cast<std::size_t>(Condition::too_fast));
  status.conditions.set(static_cast<std::size_t>(Condition::host_gone));
  status.azimuth = M_PI;
  status.cells[0][0] = {true, true, 0.87};
  status.cells[0][1] = {true, false, 0.3};
  status.frames = 212;
  status.frames_per_second = 29.96;
  status.keyframes = 38;
  status.acknowledged = 30;
  status.disk_free_mib = 12345.4;
  status.host = {.is_wanted = true, .text = "tcp://host:7410 does not answer"};
  return status;
}

TEST(StatusView, HasWhatThePageShows) {
  const json view = status_view(walking());
  EXPECT_EQ(view.at("state"), "pass");
  EXPECT_EQ(view.at("signal").at("colour"), "yellow");
  EXPECT_EQ(view.at("signal").at("pattern"), "fast_blink");
  EXPECT_EQ(view.at("signal").at("sentence"), "Too fast: walk more slowly.");
  ASSERT_EQ(view.at("conditions").size(), 2u);
  EXPECT_EQ(view.at("conditions")[1].at("name"), "host_gone");
  EXPECT_EQ(view.at("sector"), 12);
  ASSERT_EQ(view.at("coverage").size(), 2u);
  EXPECT_EQ(view.at("coverage")[0], (json{{"band", "body upper"},
                                          {"is_ring", true},
                                          {"cells", "#~" + std::string(22, '.')},
                                          {"quality", "83" + std::string(22, '0')}}));
  EXPECT_EQ(view.at("frames_per_second"), 30.0);
}

TEST(StatusText, IsOneScreen) {
  const json scans = {{{"id", "01KB9V8S2M0000000000000000"},
                       {"phase", "closed"},
                       {"reason", ""},
                       {"files", 62},
                       {"acknowledged", 30},
                       {"stage", "upload"},
                       {"fraction", 0.48}}};
  EXPECT_EQ(status_text(status_view(walking()), scans),
            "rig       pass, pass body\n"
            "do        Too fast: walk more slowly.\n"
            "also      No host: the scan is kept here, walk on.\n"
            "coverage  body upper  #~......................  1 of 24\n"
            "          body lower  ........................  0 of 24\n"
            "frames    212 at 30 a second, 38 kept, 30 at the host\n"
            "disk      12345 MiB free\n"
            "host      tcp://host:7410 does not answer\n"
            "scans     01KB9V8S2M0000000000000000  closed       30 of 62 files on the host, upload 48 %\n");
}

TEST(StatusText, BearsWhatIsMissing) {
  EXPECT_EQ(status_text(json(), json()), "rig       not running\n");
  EXPECT_EQ(status_text(json::object(), 7), "frames    0 at 0 a second, 0 kept, 0 at the host\ndisk      0 MiB free\n");
  EXPECT_NO_THROW(status_text({{"signal", 3}, {"coverage", {1, "two"}}, {"host", "none"}}, {1, {{"id", 4}}}));
  json many = json::array();
  for (int i = 0; i < 14; ++i) many.push_back({{"id", std::to_string(i)}});
  EXPECT_NE(status_text(json(), many).find("and 4 older ones"), std::string::npos);
}

}  // namespace
}  // namespace gyre
