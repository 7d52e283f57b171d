// SPDX-License-Identifier: Apache-2.0
// The host is told to end in the middle of everything. It has to, within the limit of this test, and go on afterwards.
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/keys/keys.h"
#include "common/wire/link_socket.h"
#include "common/wire/wire.h"
#include "offload/store/store.h"
#include "tests/device/spool/scan_support.h"
#include "tests/system/programs.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>
#include <csignal>
#include <nlohmann/json.hpp>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <zmq.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class StopTest : public testing::Test {
 protected:
  void start_host() {
    fs::remove(root_ / "ready.json");
    host_ =
        std::make_unique<Running>("gyre-offload",
                                  std::vector<std::string>{"serve", "--store", (root_ / "host").string(), "--endpoint",
                                                           "tcp://127.0.0.1:*", "--page", "127.0.0.1:0"},
                                  root_ / "ready.json", root_ / "host.log");
    ready_ = json::parse(first_line(root_ / "ready.json", *host_));
    const std::string page = ready_.at("page");
    page_ = page.substr(0, page.size() - 1);
  }

  // A scan whose keyframes have no end of features, so that its stages are at work for a while.
  std::string queue_scan() {
    const Scan scan = small_scan();
    const auto store = Store::open(root_ / "host").value();
    EXPECT_TRUE(store->open_scan(scan, "key", "rig"));
    const Bundle bundle = store->bundle(scan.id);
    std::vector<int> indices(30);
    std::iota(indices.begin(), indices.end(), 0);
    for (const int i : indices) {
      cv::Mat noise(1200, 900, CV_8UC3);
      cv::RNG random(static_cast<std::uint64_t>(i + 1));
      random.fill(noise, cv::RNG::UNIFORM, 0, 255);
      cv::GaussianBlur(noise, noise, {}, 2.0);
      EXPECT_TRUE(cv::imwrite(bundle.frame("body", i).string(), noise));
    }
    EXPECT_TRUE(write_frame_log(bundle, small_records(30, indices)));
    EXPECT_TRUE(store->queue_job(scan.id));
    return scan.id;
  }

  int raw_connection() const {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(page_.substr(page_.rfind(':') + 1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    return fd;
  }

  TemporaryFolder folder_;
  fs::path root_ = folder_.path();
  std::unique_ptr<Running> host_;
  json ready_;
  std::string page_;
};

TEST_F(StopTest, EndsInTheMiddleOfEverythingAndLosesNothing) {
  fs::create_directories(root_ / "host");
  const std::string queued = queue_scan();
  start_host();
  httplib::Client client(page_);

  // A device in the middle of a file, that goes on sending.
  const KeyPair keys = make_key_pair();
  ASSERT_TRUE(authorise_device(root_ / "host" / "devices", "rig-2", keys.public_key));
  zmq::context_t context;
  zmq::socket_t device(context, zmq::socket_type::dealer);
  configure_device_socket(device, keys, ready_.at("public_key"));
  device.connect(ready_.at("endpoint").get<std::string>());
  const auto say = [&](const wire::Message& message) {
    device.send(zmq::buffer(wire::encode(message)), zmq::send_flags::dontwait);
  };
  const Scan arriving = small_scan();
  const std::string stored(1000, 's');
  const std::string half(300'000, 'h');
  say(wire::Hello{wire::protocol_major, 0, "rig-2"});
  say(wire::ScanOpen{arriving.id, to_json(arriving).dump()});
  say(wire::FileChunk{arriving.id, {keyframe_name(1), stored.size(), sha256(stored)}, 0, stored});
  say(wire::FileChunk{arriving.id, {keyframe_name(2), half.size(), sha256(half)}, 0, half.substr(0, 100'000)});
  const fs::path part =
      root_ / "host" / "incoming" / arriving.id / (frame_name("body", 2) + "." + sha256(half) + ".part");
  bool acknowledged = false;
  while (!acknowledged) {
    zmq::message_t body;
    ASSERT_TRUE(device.recv(body));
    const Result<wire::Message> message = wire::decode(body.to_string_view());
    acknowledged = message && std::holds_alternative<wire::FileAck>(*message);
  }

  ASSERT_TRUE(eventually([&] { return fs::exists(part) && fs::file_size(part) == 100'000; }));

  // A stage at work, a page that watches, a request and an upload that never end.
  ASSERT_TRUE(eventually([&] {
    const auto rows = client.Get("/api/scans");
    if (!rows) return false;
    for (const json& row : json::parse(rows->body)) {
      if (row.at("id") == queued && row.at("phase") == "running") return true;
    }
    return false;
  }));
  httplib::Client watching(page_);
  std::atomic<bool> watched = false;
  std::thread watcher([&] {
    watching.Get("/api/events", [&](const char*, std::size_t) {
      watched = true;
      return true;
    });
  });
  const auto begun = client.Post("/api/uploads", {{"X-Gyre", "1"}}, R"({"bytes": 1000})", "application/json");
  ASSERT_EQ(begun->status, 201);
  const std::string upload =
      "PUT /api/uploads/" + json::parse(begun->body).at("upload").get<std::string>() +
      "/body?kind=mp4 HTTP/1.1\r\nHost: localhost\r\nX-Gyre: 1\r\nContent-Length: 1000\r\n\r\nsome";
  const std::vector<int> peers = {raw_connection(), raw_connection()};
  ASSERT_GT(::send(peers[0], upload.data(), upload.size(), 0), 0);
  ASSERT_GT(::send(peers[1], "GET / HTT", 9, 0), 0);
  ASSERT_TRUE(eventually([&] { return watched.load(); }));

  host_->signal(SIGTERM);
  EXPECT_EQ(host_->wait(), 0) << read_file(root_ / "host.log").value_or("");
  watcher.join();
  for (const int peer : peers) ::close(peer);

  {
    const auto store = Store::open(root_ / "host").value();
    EXPECT_EQ(store->scan(queued).value()->phase, StorePhase::queued);
    EXPECT_TRUE(store->file(arriving.id, keyframe_name(1)).value());
    EXPECT_TRUE(store->verify(arriving.id)->empty());
    EXPECT_EQ(fs::file_size(part), 100'000U);
  }
  start_host();  // and goes on
  EXPECT_EQ(host_->stop(), 0);
}

}  // namespace
}  // namespace gyre
