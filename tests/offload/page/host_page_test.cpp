// SPDX-License-Identifier: Apache-2.0
// The host's page as a browser asks for it, over a real socket and a real store.
#include "offload/page/host_page.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"
#include "common/http/own_address.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <httplib.h>
#include <future>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const httplib::Headers marked = {{"X-Gyre", "1"}};

class HostPageTest : public ::testing::Test {
 protected:
  void SetUp() override {
    store_ = Store::open(folder_.path() / "store").value();
    add_scan();
    open_page();
  }

  void open_page(const HttpOptions& http = {}) {
    ScanActions actions;
    actions.work = [this] { return std::map<std::string, ScanActivity>{{scan_, {"cloud", 0.25, "depth"}}}; };
    actions.queued = [this](const std::string& scan) { queued_.set_value(scan); };
    actions.cancel = [](const std::string&) -> Result<void> { return fail("it has no job"); };
    actions.rerun = [this](const std::string& scan, const json& options) -> Result<void> {
      rerun_ = {scan, options};
      return {};
    };
    actions.remove = [this](const std::string& scan) -> Result<void> {
      const Result<DeletionReceipt> receipt = store_->delete_scan(scan);
      if (!receipt) return tl::unexpected(receipt.error());
      return {};
    };
    actions.devices = [this] { return std::vector{device_}; };
    Stage stage;
    stage.name = "texture";
    stage.options = {{"size", 4096}, {"network", ""}};
    stage.external = {"network"};
    HostPageOptions options;
    options.http = http;
    options.reserve_bytes = 0;
    page_ = std::make_unique<HostPage>(options, *store_, std::vector{stage}, actions);
    ASSERT_TRUE(page_->start());
    client_ = std::make_unique<httplib::Client>("127.0.0.1", page_->server().port());
  }

  void add_scan() {
    Scan scan;
    scan.id = scan_;
    scan.created = "2026-01-01T00:00:00Z";
    scan.height_mm = 1700.0;
    ASSERT_TRUE(store_->open_scan(scan, "a key", "rig-1"));
    const Bundle bundle = store_->bundle(scan_);
    ASSERT_TRUE(cv::imwrite(bundle.frame("body", 3).string(), cv::Mat(160, 80, CV_8UC3, cv::Scalar(10, 200, 30))));
    ASSERT_TRUE(write_file(bundle.root() / "avatar.glb", "an avatar"));
    ASSERT_TRUE(write_file(bundle.root() / "report.html", "<p>report</p>"));
    ASSERT_TRUE(write_file(bundle.root() / "report.json", R"({"warnings": ["the left hand was not seen."]})"));
  }

  json get(const std::string& path) {
    const auto answer = client_->Get(path);
    return answer && answer->status == 200 ? json::parse(answer->body) : json();
  }

  // A video of a texture that moves on, so that there are keyframes to select.
  std::string video() const {
    const fs::path file = folder_.path() / "video.avi";
    cv::Mat noise(120, 400, CV_8UC3);
    cv::RNG random(3);
    random.fill(noise, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(noise, noise, {}, 2.0);
    cv::VideoWriter writer(file.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 30, {160, 120});
    for (int i = 0; i < 40; ++i) writer.write(noise(cv::Rect(4 * i, 0, 160, 120)));
    writer.release();
    return read_file(file).value();
  }

  std::string begin_upload(std::size_t bytes) {
    const auto begun = client_->Post("/api/uploads", marked, json{{"bytes", bytes}}.dump(), "application/json");
    return json::parse(begun->body).at("upload");
  }

  TemporaryFolder folder_;
  const std::string scan_ = new_ulid();
  DeviceView device_{"a key", "rig-1", true, "2026-01-01T00:00:00Z", {}, {}, {}};
  std::unique_ptr<Store> store_;
  std::promise<std::string> queued_;
  std::pair<std::string, json> rerun_;
  std::unique_ptr<HostPage> page_;
  std::unique_ptr<httplib::Client> client_;
};

TEST_F(HostPageTest, ListsScansAndWhatIsDoneToThem) {
  const json rows = get("/api/scans");
  ASSERT_EQ(rows.size(), 1U);
  const json& row = rows[0];
  EXPECT_EQ(row.at("id"), scan_);
  EXPECT_EQ(row.at("device"), "rig-1");
  EXPECT_EQ(row.at("phase"), "receiving");
  EXPECT_EQ(row.at("stage"), "cloud");
  EXPECT_EQ(row.at("fraction"), 0.25);
  EXPECT_EQ(row.at("cover"), "body-000003.jpg");
  EXPECT_EQ(row.at("files"), json({"avatar.glb", "report.html", "report.json"}));
  const json view = get("/api/scans/" + scan_);
  EXPECT_EQ(view.at("height_mm"), 1700.0);
  EXPECT_EQ(view.at("warnings"), json({"the left hand was not seen."}));
  EXPECT_EQ(view.at("stages")[0].at("options"), json({{"size", 4096}}));
  EXPECT_EQ(client_->Get("/api/scans/" + new_ulid())->status, 404);
}

TEST_F(HostPageTest, ShowsWhatDevicesTellOfThemselvesAndOfTheScanTheyRecord) {
  EXPECT_EQ(get("/api/scans")[0].at("device_text"), "");
  EXPECT_TRUE(get("/api/devices")[0].at("status").is_null());
  device_.status = wire::DeviceStatus{"recording", "walk on", scan_, 1000, 1, 7};
  device_.coverage = wire::CoveragePreview{scan_, "body", {{"body upper", 0.5, std::string("\xff\0", 2)}}};
  const json row = get("/api/scans")[0];
  EXPECT_EQ(row.at("device_text"), "walk on");
  EXPECT_EQ(row.at("coverage").at("bands")[0].at("cells"), json({255, 0}));
  const json told = get("/api/devices")[0];
  EXPECT_EQ(told.at("name"), "rig-1");
  EXPECT_EQ(told.at("status").at("waiting_files"), 7);
  EXPECT_EQ(told.at("coverage").at("scan"), scan_);
  device_.connected = false;
  EXPECT_EQ(get("/api/scans")[0].at("device_text"), "the device is out of reach");
  device_.key = "another key";  // may say what it likes
  EXPECT_EQ(get("/api/scans")[0].at("device_text"), "");
  EXPECT_TRUE(get("/api/scans")[0].at("coverage").is_null());
}

TEST_F(HostPageTest, HandsOutWhatItKnowsAndNothingElse) {
  const std::string scan = "/scans/" + scan_;
  EXPECT_EQ(client_->Get(scan + "/avatar.glb")->body, "an avatar");
  EXPECT_EQ(client_->Get(scan + "/avatar.glb?download=1")->get_header_value("Content-Disposition"),
            "attachment; filename=\"" + scan_ + "-avatar.glb\"");
  const auto report = client_->Get(scan + "/report.html");
  EXPECT_NE(report->get_header_value("Content-Security-Policy").find("sandbox"), std::string::npos);
  const auto small = client_->Get(scan + "/frames/body-000003.jpg?small=1");
  ASSERT_EQ(small->status, 200);
  const cv::Mat picture = cv::imdecode(std::vector<char>(small->body.begin(), small->body.end()), cv::IMREAD_COLOR);
  EXPECT_EQ(picture.size(), cv::Size(20, 40));
  for (const std::string& path :
       {scan + "/avatar.vrm", scan + "/scan.json", scan + "/../../catalogue.sqlite", scan + "/%2e%2e/%2e%2e/host.key",
        scan + "/frames/..%2fscan.json", scan + "/frames/body-000004.jpg", scan + "/frames/body-000004.jpg?small=1",
        scan + "/texture/source.png", std::string("/scans/../host.key"), "/scans/" + new_ulid() + "/avatar.glb"}) {
    EXPECT_EQ(client_->Get(path)->status, 404) << path;
  }
}

TEST_F(HostPageTest, GivesAndDoesNothingForWhoComesFromElsewhereWithoutTheToken) {
  HttpOptions http;
  http.address = "0.0.0.0";
  http.token = std::string(40, 'a');
  open_page(http);
  httplib::Client elsewhere(own_address(), page_->server().port());
  const auto refused = elsewhere.Get("/");
  if (!refused || refused->status == 403) GTEST_SKIP() << "this machine has no address but its loopback";
  const std::string scan = "/api/scans/" + scan_;
  const std::string files = "/scans/" + scan_;
  const std::string upload = "/api/uploads/" + begin_upload(1000);
  const auto expect_refused = [&](const std::string& path) {
    EXPECT_EQ(elsewhere.Get(path)->status, 401) << path;
    EXPECT_EQ(elsewhere.Get(path, httplib::Headers{{"Authorization", "Bearer " + std::string(40, 'b')}})->status, 401);
  };
  for (const char* path : {"/", "/index.html", "/api/scans", "/api/devices", "/api/events"}) expect_refused(path);
  for (const char* part : {"", "/landmarks"}) expect_refused(scan + part);
  for (const char* file : {"/avatar.glb", "/report.html", "/frames/body-000003.jpg", "/texture/source.png"}) {
    expect_refused(files + file);
  }
  const auto expect_not_done = [&](const std::string& path) {
    EXPECT_EQ(elsewhere.Post(path, marked, "{}", "application/json")->status, 401) << path;
  };
  for (const char* verb : {"/cancel", "/rerun"}) expect_not_done(scan + verb);
  expect_not_done("/api/uploads");
  expect_not_done(upload + "/finish");
  EXPECT_EQ(elsewhere.Put(upload + "/body", marked, "video", "video/mp4")->status, 401);
  EXPECT_EQ(elsewhere.Put(scan + "/landmarks", marked, "{}", "application/json")->status, 401);
  EXPECT_EQ(elsewhere.Delete(upload, marked)->status, 401);
  EXPECT_EQ(elsewhere.Delete(scan, marked)->status, 401);
  EXPECT_EQ(get("/api/scans").size(), 1U);
  EXPECT_EQ(elsewhere.Get(scan, httplib::Headers{{"Authorization", "Bearer " + http.token}})->status, 200);
}

TEST_F(HostPageTest, RunsAScanAgainWithCheckedOptions) {
  const std::string path = "/api/scans/" + scan_ + "/rerun";
  EXPECT_EQ(client_->Post(path, marked, R"({"options": {"texture": {"size": 1024}}})", "application/json")->status,
            200);
  EXPECT_EQ(rerun_.first, scan_);
  EXPECT_EQ(rerun_.second, json({{"texture", {{"size", 1024}}}}));
  for (const char* body :
       {R"({"options": {"texture": {"network": "/etc/passwd"}}})", R"({"options": 3})", "nonsense"}) {
    EXPECT_EQ(client_->Post(path, marked, body, "application/json")->status, 400) << body;
  }
  EXPECT_EQ(client_->Post(path, R"({"options": {}})", "application/json")->status, 403);
  const auto cancelled = client_->Post("/api/scans/" + scan_ + "/cancel", marked, "{}", "application/json");
  EXPECT_EQ(cancelled->status, 500);
  EXPECT_EQ(json::parse(cancelled->body).at("error"), "it has no job");
}

TEST_F(HostPageTest, KeepsPickedLandmarksAndRunsTheScanAgain) {
  const std::string path = "/api/scans/" + scan_ + "/landmarks";
  const json picked = {{"version", 1}, {"landmarks", {{"noseTip", {{"pixels", {{"body-000003.jpg", {4.5, 5.5}}}}}}}}};
  EXPECT_EQ(client_->Put(path, marked, picked.dump(), "application/json")->status, 200);
  EXPECT_EQ(rerun_.first, scan_);
  EXPECT_EQ(get(path).at("picked"), picked.at("landmarks"));
  EXPECT_EQ(client_->Put(path, marked, R"({"version": 1})", "application/json")->status, 400);
}

TEST_F(HostPageTest, MakesAScanOfAnUpload) {
  const std::string bytes = video();
  const std::string id = begin_upload(bytes.size());
  const std::string upload = "/api/uploads/" + id;
  EXPECT_EQ(client_->Post(upload + "/finish", marked, "{}", "application/json")->status, 400);
  EXPECT_EQ(client_->Put(upload + "/feet?kind=avi", marked, bytes, "video/avi")->status, 404);
  ASSERT_EQ(client_->Put(upload + "/body?kind=avi", marked, bytes, "video/avi")->status, 200);
  EXPECT_EQ(client_->Post(upload + "/finish", marked, R"({"height_mm": 17})", "application/json")->status, 400);
  const auto finished = client_->Post(upload + "/finish", marked, R"({"height_mm": 1700})", "application/json");
  ASSERT_EQ(finished->status, 201) << finished->body;
  EXPECT_EQ(json::parse(finished->body).at("scan"), id);
  EXPECT_EQ(queued_.get_future().get(), id);
  const Result<std::optional<StoredScan>> scan = store_->scan(id);
  ASSERT_TRUE(scan && *scan);
  EXPECT_EQ((*scan)->phase, StorePhase::queued);
  EXPECT_TRUE(store_->verify(id).value().empty());
  EXPECT_EQ(read_scan(store_->bundle(id))->height_mm, 1700.0);
  EXPECT_FALSE(fs::exists(folder_.path() / "store" / "uploads" / id));
  EXPECT_GT(get("/api/scans/" + id).at("keyframes").get<int>(), 2);
}

TEST_F(HostPageTest, SaysWhatIsWrongWithAnUploadThatIsNoVideo) {
  const std::string id = begin_upload(7);
  ASSERT_EQ(client_->Put("/api/uploads/" + id + "/body?kind=mp4", marked, "nothing", "video/mp4")->status, 200);
  ASSERT_EQ(client_->Post("/api/uploads/" + id + "/finish", marked, "{}", "application/json")->status, 201);
  std::string heard;
  client_->Get("/api/events", [&](const char* data, std::size_t length) {
    heard.append(data, length);
    return heard.find("\"failed\"") == std::string::npos;
  });
  const Result<std::optional<StoredScan>> scan = store_->scan(id);
  ASSERT_TRUE(scan && *scan);
  EXPECT_EQ((*scan)->phase, StorePhase::failed);
  EXPECT_FALSE((*scan)->reason.empty());
}

TEST_F(HostPageTest, GoesOnWithAnUploadAfterARestart) {
  const std::string bytes = video();
  const std::string id = begin_upload(bytes.size());
  ASSERT_EQ(client_->Put("/api/uploads/" + id + "/body?kind=avi", marked, bytes, "video/avi")->status, 200);
  page_.reset();
  // As a crash right after the upload was finished leaves it.
  UploadDesk desk(folder_.path() / "store" / "uploads", 0);
  ASSERT_TRUE(desk.finish(id, {}));
  open_page();
  EXPECT_EQ(queued_.get_future().get(), id);
  EXPECT_EQ(store_->scan(id).value()->phase, StorePhase::queued);
}

TEST_F(HostPageTest, DeletesAScanAndTellsTheOthers) {
  std::string heard;
  bool deleted = false;
  client_->Get("/api/events", [&](const char* data, std::size_t length) {
    heard.append(data, length);
    // Told of once by the watching thread, it will be told of when it goes.
    if (!deleted && heard.find("event: scan\n") != std::string::npos) {
      deleted = true;
      httplib::Client other("127.0.0.1", page_->server().port());
      EXPECT_EQ(other.Delete("/api/scans/" + scan_)->status, 403);
      EXPECT_EQ(other.Delete("/api/scans/" + scan_, marked)->status, 200);
    }
    return heard.find("event: deleted") == std::string::npos;
  });
  EXPECT_NE(heard.find("event: scans\ndata: [{"), std::string::npos);
  EXPECT_FALSE(fs::exists(store_->bundle(scan_).root()));
  EXPECT_EQ(client_->Delete("/api/scans/" + scan_, marked)->status, 404);
}

}  // namespace
}  // namespace gyre
