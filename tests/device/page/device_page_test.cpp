// SPDX-License-Identifier: Apache-2.0
// The rig's page as a browser asks for it, over a real socket and a real spool.
#include "device/page/device_page.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"
#include "common/http/own_address.h"
#include "device/page/page_link.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>
#include <httplib.h>
#include <atomic>
#include <future>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* secret = "0123456789abcdef0123";
const httplib::Headers marked = {{"X-Gyre", "1"}};

// What came of a stream of events, until it has been enough.
class Listener {
 public:
  Listener(httplib::Client& client, const std::function<bool(const std::string&)>& is_enough) {
    client.Get("/api/events", [&](const char* data, std::size_t length) {
      heard_.append(data, length);
      return !is_enough(heard_);
    });
  }
  const std::string& heard() const { return heard_; }

 private:
  std::string heard_;
};

class DevicePageTest : public testing::Test {
 protected:
  void SetUp() override {
    spool_ = Spool::open(folder_.path() / "spool", 0).value();
    ASSERT_TRUE(spool_scan(*spool_, scan_, {2, 5, 9}, 3000, 1));
    page_ =
        std::make_unique<DevicePage>(HttpOptions(), *spool_, [this](const OperatorCommand& command) -> Result<void> {
          commands_.push_back(command);
          if (is_busy_) return fail("the rig is busy", "", "wait a moment");
          return {};
        });
    ASSERT_TRUE(page_->start());
    client_ = std::make_unique<httplib::Client>("127.0.0.1", page_->port());
  }

  json get(const std::string& path) {
    const auto answer = client_->Get(path);
    return answer && answer->status == 200 ? json::parse(answer->body) : json();
  }

  int command(const std::string& body, const httplib::Headers& headers = marked) {
    return client_->Post("/api/commands", headers, body, "application/json")->status;
  }

  // Everything of the scan goes to the host, and the avatar comes back.
  void deliver() {
    const std::optional<SpooledScan> scan = spool_->scan(scan_.id);
    for (const SpooledFile& file : scan->files) {
      if (file.phase == SpooledFilePhase::spooled) {
        ASSERT_TRUE(spool_->acknowledge_file(scan_.id, file.name, file.sha256));
      }
    }
    ASSERT_TRUE(spool_->acknowledge_scan(scan_.id));
    const fs::path came = folder_.path() / "avatar.part";
    ASSERT_TRUE(write_file(came, "an avatar"));
    ASSERT_TRUE(spool_->add_result(scan_.id, {"avatar.glb", 9, sha256_of_file(came).value()}, came));
    ASSERT_TRUE(spool_->deliver_scan(scan_.id));
  }

  TemporaryFolder folder_;
  const Scan scan_ = small_scan();
  std::unique_ptr<Spool> spool_;
  std::vector<OperatorCommand> commands_;
  bool is_busy_ = false;
  std::unique_ptr<DevicePage> page_;
  std::unique_ptr<httplib::Client> client_;
};

TEST_F(DevicePageTest, IsServed) {
  const auto page = client_->Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_NE(page->body.find("Gyre"), std::string::npos);
  EXPECT_NE(page->get_header_value("Content-Security-Policy").find("default-src 'self'"), std::string::npos);
}

TEST_F(DevicePageTest, TellsWhatIsSoNow) {
  EXPECT_EQ(get("/api/status").at("state"), "idle");
  LiveStatus status;
  status.state = SessionState::pass;
  status.pass = "head";
  page_->show(status);
  const json now = get("/api/status");
  EXPECT_EQ(now.at("state"), "pass");
  EXPECT_EQ(now.at("coverage").size(), 3u);
}

TEST_F(DevicePageTest, TellsWhoWatchesOfChanges) {
  LiveStatus status;
  const Listener listener(*client_, [&](const std::string& heard) {
    // The greeting has both; what is shown after it comes by itself.
    if (heard.find("event: scans") != std::string::npos && status.frames == 0) {
      status.frames = 77;
      page_->show(status);
    }
    return heard.find("\"frames\":77") != std::string::npos;
  });
  EXPECT_TRUE(listener.heard().starts_with("event: status\ndata: {"));
  EXPECT_NE(listener.heard().find(scan_.id), std::string::npos);
}

TEST_F(DevicePageTest, TellsWhoWatchesOfScansThatComeBack) {
  bool is_delivered = false;
  const Listener listener(*client_, [&](const std::string& heard) {
    if (!std::exchange(is_delivered, true)) deliver();
    return heard.find(R"("phase":"delivered")") != std::string::npos;
  });
  const json row = get("/api/scans")[0];
  EXPECT_EQ(row.at("id"), scan_.id);
  EXPECT_EQ(row.at("keyframes"), 3);
  EXPECT_EQ(row.at("files"), 5);
  EXPECT_EQ(row.at("acknowledged"), 5);
  EXPECT_EQ(row.at("results"), json({"avatar.glb"}));
}

TEST_F(DevicePageTest, SaysHowFarTheHostIs) {
  LiveStatus status;
  status.scan = scan_.id;
  status.host.stage = "cloud";
  status.host.fraction = 0.25;
  page_->show(status);
  const json row = get("/api/scans")[0];
  EXPECT_EQ(row.at("stage"), "cloud");
  EXPECT_EQ(row.at("fraction"), 0.25);
}

TEST_F(DevicePageTest, HandsOutTheLatestPicture) {
  // The camera goes on as long as somebody looks.
  std::atomic<bool> is_done{false};
  std::thread camera([&] {
    while (!is_done) {
      page_->preview(cv::Mat(60, 80, CV_8UC3, cv::Scalar::all(90)));
      std::this_thread::yield();
    }
  });
  const auto first = client_->Get("/api/preview.jpg?after=0");
  const auto next = client_->Get("/api/preview.jpg?after=" + first->get_header_value("X-Gyre-Number"));
  is_done = true;
  camera.join();
  ASSERT_EQ(first->status, 200);
  EXPECT_EQ(first->get_header_value("Content-Type"), "image/jpeg");
  EXPECT_EQ(first->get_header_value("Cache-Control"), "no-store");
  EXPECT_EQ(cv::imdecode(std::vector<char>(first->body.begin(), first->body.end()), cv::IMREAD_COLOR).cols, 80);
  EXPECT_GT(std::stoi(next->get_header_value("X-Gyre-Number")), std::stoi(first->get_header_value("X-Gyre-Number")));
}

TEST_F(DevicePageTest, HasNoPictureWithoutACamera) {
  EXPECT_EQ(client_->Get("/api/preview.jpg?after=0")->status, 204);
}

TEST_F(DevicePageTest, PassesOnWhatTheOperatorAsksFor) {
  EXPECT_EQ(command(R"({"command": "start", "height_mm": 1712})"), 200);
  EXPECT_EQ(command(R"({"command": "stop"})"), 200);
  EXPECT_EQ(command(R"({"command": "cancel"})"), 200);
  EXPECT_EQ(command(R"({"command": "acknowledge"})"), 200);
  ASSERT_EQ(commands_.size(), 4u);
  EXPECT_EQ(commands_[0].kind, OperatorCommand::Kind::start);
  EXPECT_EQ(commands_[0].height_mm, 1712.0);
  EXPECT_EQ(commands_[1].kind, OperatorCommand::Kind::stop);
  EXPECT_EQ(commands_[2].kind, OperatorCommand::Kind::cancel);
  EXPECT_EQ(commands_[3].kind, OperatorCommand::Kind::acknowledge);
}

TEST_F(DevicePageTest, RefusesWhatIsNoCommand) {
  for (const char* body :
       {"", "3", "nonsense", "{}", R"({"command": 3})", R"({"command": "shut_down"})", R"({"command": "dance"})",
        R"({"command": "start", "height_mm": "tall"})", R"({"command": "start", "height_mm": 17})"}) {
    EXPECT_EQ(command(body), 400) << body;
  }
  // From another site's page, with the user's browser.
  EXPECT_EQ(command(R"({"command": "start"})", {}), 403);
  EXPECT_EQ(command(R"({"command": "start"})", {{"X-Gyre", "1"}, {"Origin", "http://evil.example"}}), 403);
  EXPECT_TRUE(commands_.empty());
  is_busy_ = true;
  const auto answer = client_->Post("/api/commands", marked, R"({"command": "start"})", "application/json");
  EXPECT_EQ(answer->status, 409);
  EXPECT_NE(answer->body.find("wait a moment"), std::string::npos);
}

TEST_F(DevicePageTest, HandsOutWhatItKnowsAndNothingElse) {
  const std::string scan = "/scans/" + scan_.id;
  EXPECT_EQ(client_->Get(scan + "/avatar.glb")->status, 404);
  deliver();
  EXPECT_EQ(client_->Get(scan + "/avatar.glb")->body, "an avatar");
  EXPECT_EQ(client_->Get(scan + "/avatar.glb?download=1")->get_header_value("Content-Disposition"),
            "attachment; filename=\"" + scan_.id + "-avatar.glb\"");
  const auto small = client_->Get(scan + "/frames/body-000005.jpg");
  ASSERT_EQ(small->status, 200);
  EXPECT_EQ(cv::imdecode(std::vector<char>(small->body.begin(), small->body.end()), cv::IMREAD_COLOR).cols, 2);
  for (const std::string& path :
       {scan + "/avatar.vrm", scan + "/scan.json", scan + "/spool.jsonl", scan + "/../unfinished",
        scan + "/%2e%2e/%2e%2e/keys/device.key", scan + "/frames/..%2fscan.json", scan + "/frames/body-000004.jpg",
        "/scans/" + new_ulid() + "/avatar.glb", std::string("/api/nothing")}) {
    EXPECT_EQ(client_->Get(path)->status, 404) << path;
  }
}

TEST_F(DevicePageTest, LetsGoWhoWatchesWhenItStops) {
  std::promise<void> watches;
  std::thread watcher([&] {
    bool is_first = true;
    client_->Get("/api/events", [&](const char*, std::size_t) {
      if (std::exchange(is_first, false)) watches.set_value();
      return true;
    });
  });
  watches.get_future().wait();
  page_->stop();
  watcher.join();
}

TEST_F(DevicePageTest, NeedsItsTokenFromElsewhere) {
  HttpOptions http;
  http.address = "0.0.0.0";
  http.token = secret;
  DevicePage page(http, *spool_, [](const OperatorCommand&) -> Result<void> { return {}; });
  ASSERT_TRUE(page.start());
  httplib::Client elsewhere(own_address(), page.port());
  const auto refused = elsewhere.Get("/");
  if (!refused || refused->status == 403) GTEST_SKIP() << "this machine has no address but its loopback";
  EXPECT_EQ(refused->status, 401);
  EXPECT_NE(refused->body.find("<h1>"), std::string::npos);
  for (const char* path : {"/api/status", "/api/scans", "/api/events", "/api/preview.jpg"}) {
    EXPECT_EQ(elsewhere.Get(path)->status, 401) << path;
  }
  EXPECT_EQ(elsewhere.Post("/api/commands", marked, R"({"command": "start"})", "application/json")->status, 401);
  // By the link, and from then on by the cookie it leaves.
  const auto welcome = elsewhere.Get(page.url().substr(page.url().find("/?")));
  ASSERT_EQ(welcome->status, 303);
  const std::string cookie = welcome->get_header_value("Set-Cookie");
  EXPECT_EQ(elsewhere.Get("/api/status", httplib::Headers{{"Cookie", cookie.substr(0, cookie.find(';'))}})->status,
            200);
}

TEST(PageLink, ShowsTheAddress) {
  const std::string text = page_link("http://192.168.1.2:7470/?token=0123");
  EXPECT_NE(text.find("http://192.168.1.2:7470/?token=0123\n"), std::string::npos);
  EXPECT_NE(text.find("█"), std::string::npos);
}

}  // namespace
}  // namespace gyre
