// SPDX-License-Identifier: Apache-2.0
// Attacks on a host, while a device that belongs to it works: nothing gets in, nothing falls over, each is in the log.
#include "common/bundle/sha256.h"
#include "tests/offload/ingest/link_support.h"
#include "tests/offload/ingest/raw_device.h"
#include "tests/offload/ingest/tcp_proxy.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

class Attack : public testing::Test {
 protected:
  void SetUp() override {
    host_.authorise(rig_.options().keys);
    host_.authorise(keys_);
    host_.start();
    rig_.connect(host_);
    expect_work();
  }
  void TearDown() override { expect_work(); }

  // The device that belongs here sends a scan, and the host has it.
  void expect_work() {
    const Scan scan = small_scan();
    ASSERT_TRUE(spool_scan(rig_.spool(), scan, {1, 2}, 100'000, ++seed_));
    ASSERT_TRUE(eventually([&] { return rig_.spool().phase(scan.id) == SpoolPhase::acknowledged; }));
    EXPECT_TRUE(host_.store().verify(scan.id)->empty());
    scans_.push_back(scan.id);
  }
  bool is_logged(const std::string& text) {
    return eventually([&] { return log_.has(text); });
  }
  std::uint16_t port() const {
    const std::string& endpoint = host_.options().endpoint;
    return static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1)));
  }
  int connection() const {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port());
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
    ::close(fd);
    return -1;
  }
  // Reads until the host hangs up.
  static std::string hear_out(int fd) {
    std::string heard;
    std::array<char, 4096> block{};
    for (ssize_t got = 0; (got = ::recv(fd, block.data(), block.size(), 0)) > 0;) {
      heard.append(block.data(), static_cast<std::size_t>(got));
    }
    ::close(fd);
    return heard;
  }
  RawDevice paired() {
    RawDevice device(host_, keys_);
    device.say(wire::Hello{wire::protocol_major, 0, "bad one"});
    device.hear<wire::Welcome>();
    return device;
  }
  // Only what the good device sent is in the store.
  void expect_nothing_came_in() {
    const std::vector<StoredScan> scans = host_.store().scans().value();
    std::vector<std::string> stored;
    for (const StoredScan& scan : scans) stored.push_back(scan.id);
    std::vector<std::string> sent = scans_;
    std::sort(sent.begin(), sent.end());
    EXPECT_EQ(stored, sent);
  }

  const LogCapture log_;
  TestHost host_;
  TestDevice rig_{"rig"};
  KeyPair keys_ = make_key_pair();  // of a device that is paired, and not what it seems
  std::vector<std::string> scans_;
  std::uint64_t seed_ = 0;
};

TEST_F(Attack, WithoutAKey) {
  zmq::context_t context;
  zmq::socket_t plain(context, zmq::socket_type::dealer);
  plain.set(zmq::sockopt::linger, 0);
  plain.connect(host_.options().endpoint);
  plain.send(zmq::buffer(wire::encode(wire::Hello{})), zmq::send_flags::none);
  EXPECT_TRUE(is_logged("turned away"));
  EXPECT_GT(host_.server().board().counts.failed_handshakes, 0U);
  EXPECT_EQ(host_.server().board().devices().size(), 1U);
}

TEST_F(Attack, WithAnotherProtocolAltogether) {
  const int fd = connection();
  const std::string request = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n" + std::string(1000, 'x');
  ASSERT_GT(::send(fd, request.data(), request.size(), MSG_NOSIGNAL), 0);
  hear_out(fd);
  EXPECT_TRUE(is_logged("turned away 1 connection(s) that do not speak as a paired device does"));
}

TEST_F(Attack, WithAnUnknownKey) {
  const KeyPair unknown = make_key_pair();
  RawDevice stranger(host_, unknown);
  stranger.say(wire::Hello{wire::protocol_major, 0, "stranger"});
  EXPECT_TRUE(is_logged("its key " + unknown.public_key + " is not on the list"));
  expect_work();
  expect_nothing_came_in();
}

TEST_F(Attack, WithAKeyThatWasRevoked) {
  RawDevice device = paired();
  ASSERT_TRUE(revoke_device(host_.options().allow_list, sha256(keys_.public_key).substr(0, 12)));
  const Scan scan = small_scan();
  device.say(wire::ScanOpen{scan.id, to_json(scan).dump()});
  EXPECT_TRUE(device.hear<wire::Refused>().permanent);
  EXPECT_TRUE(is_logged("was shut out"));
  RawDevice again(host_, keys_);
  again.say(wire::Hello{wire::protocol_major, 0, "bad one"});
  EXPECT_TRUE(is_logged("its key " + keys_.public_key + " is not on the list"));
  expect_nothing_came_in();
}

TEST_F(Attack, OnAnotherDevicesScan) {
  const std::string scan = scans_.at(0);
  const std::string picture(1000, 'p');
  const wire::FileEntry file{keyframe_name(1), picture.size(), sha256(picture)};
  const Scan described = read_scan(host_.store().bundle(scan)).value();
  const std::vector<StoredFile> before = host_.store().files(scan).value();
  RawDevice opening = paired();
  opening.say(wire::ScanOpen{scan, to_json(described).dump()});
  EXPECT_EQ(opening.hear<wire::ScanState>().phase, wire::ScanPhase::refused);
  EXPECT_TRUE(is_logged("asked for scan " + scan + ", which belongs to another device"));
  for (const wire::Message& message :
       {wire::Message(wire::FileChunk{scan, file, 0, picture}), wire::Message(wire::Discard{scan, keyframe_name(1)}),
        wire::Message(wire::ScanClose{scan, {file}}), wire::Message(wire::ResultAck{scan}),
        wire::Message(wire::ResultRequest{scan, "avatar.glb", file.sha256, 0})}) {
    RawDevice device = paired();
    device.say(message);
    EXPECT_TRUE(device.hear<wire::Refused>().permanent);
  }
  EXPECT_TRUE(is_logged("refused device bad one: scan " + scan + " is not open here"));
  const auto same = [](const StoredFile& a, const StoredFile& b) { return a.name == b.name && a.sha256 == b.sha256; };
  const std::vector<StoredFile> after = host_.store().files(scan).value();
  EXPECT_TRUE(std::equal(before.begin(), before.end(), after.begin(), after.end(), same));
}

TEST_F(Attack, WithPathsThatLeadElsewhere) {
  const Scan scan = small_scan();
  const std::string picture(10, 'p');
  const std::uint64_t outside = bytes_below(host_.folder() / "devices");
  for (const char* name : {"../../../devices/bad.pub", "/etc/passwd", "frames/../../../host.key", "frames/..",
                           "scan.json/..", "frames/body-000001.jpg/../../scan.json"}) {
    RawDevice device = paired();
    device.say(wire::ScanOpen{scan.id, to_json(scan).dump()});
    device.say(wire::FileChunk{scan.id, {name, picture.size(), sha256(picture)}, 0, picture});
    EXPECT_TRUE(device.hear<wire::Refused>().permanent) << name;
  }
  RawDevice device = paired();
  device.say(wire::ScanOpen{"../../devices", to_json(scan).dump()});
  EXPECT_TRUE(device.hear<wire::Refused>().permanent);
  EXPECT_TRUE(is_logged("unacceptable file name"));
  EXPECT_TRUE(is_logged("unacceptable scan id"));
  EXPECT_EQ(bytes_below(host_.folder() / "devices"), outside);
  ASSERT_TRUE(host_.store().delete_scan(scan.id));
}

TEST_F(Attack, WithMessagesThatAreTooLarge) {
  RawDevice device = paired();
  device.say_bytes(std::string(wire::max_message_bytes + 1, 'x'));
  EXPECT_TRUE(device.hear<wire::Refused>().permanent);
  EXPECT_TRUE(is_logged("larger than a message may be"));
  device.say_bytes(std::string(64 << 20, 'x'));
  EXPECT_TRUE(is_logged("connection(s) ended"));
}

TEST_F(Attack, WithMessagesThatAreNone) {
  RawDevice device = paired();
  for (const std::string& bytes : {std::string(), std::string(1000, '\xff'), std::string("\x1a\x02\x08"),
                                   wire::encode(wire::Hello{}) + "\x0a\xff\xff\xff\xff\x0f"}) {
    device.say_bytes(bytes);
  }
  EXPECT_TRUE(device.hear<wire::Refused>().permanent);
  EXPECT_TRUE(is_logged("malformed message"));
}

TEST_F(Attack, WithARecordingOfASession) {
  TcpProxy line(port());
  line.record();
  TestDevice recorded("recorded");
  host_.authorise(recorded.options().keys);
  recorded.connect(host_, line.endpoint());
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(recorded.spool(), scan, {1}, 50'000, 99));
  ASSERT_TRUE(eventually([&] { return recorded.spool().phase(scan.id) == SpoolPhase::acknowledged; }));
  recorded.stop();
  scans_.push_back(scan.id);
  const std::string session = line.recorded();
  ASSERT_GT(session.size(), 50'000U);
  ASSERT_TRUE(host_.store().delete_scan(scan.id));
  std::erase(scans_, scan.id);

  const std::uint64_t before = host_.server().board().counts.connections;
  const int fd = connection();
  for (std::size_t sent = 0; sent < session.size();) {
    const ssize_t n = ::send(fd, session.data() + sent, session.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) break;  // the host has hung up already
    sent += static_cast<std::size_t>(n);
  }
  hear_out(fd);
  EXPECT_TRUE(is_logged("turned away"));
  EXPECT_EQ(host_.server().board().counts.connections, before);
  expect_nothing_came_in();
}

// Connections of a process of their own, that say nothing.
TEST_F(Attack, WithTenThousandHalfOpenConnections) {
  rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  limit.rlim_cur = limit.rlim_max;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
  constexpr rlim_t others = 500;
  const auto wanted = static_cast<int>(std::min<rlim_t>(10'000, limit.rlim_max - others));
  std::array<int, 2> say{};
  ASSERT_EQ(::pipe2(say.data(), O_CLOEXEC), 0);
  const pid_t attacker = ::fork();
  if (attacker == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    int open = 0;
    while (open < wanted && connection() >= 0) ++open;
    if (::write(say[1], &open, sizeof open) != sizeof open) ::_exit(1);
    ::pause();
  }
  ::close(say[1]);
  int open = 0;
  ASSERT_EQ(::read(say[0], &open, sizeof open), static_cast<ssize_t>(sizeof open));
  EXPECT_EQ(open, wanted);
  std::printf("half-open connections: %d\n", open);
  expect_work();
  // One that was there before, and one that comes now.
  TestDevice late("late");
  host_.authorise(late.options().keys);
  late.connect(host_);
  EXPECT_TRUE(eventually([&] { return late.uplink().status().phase == LinkStatus::Phase::connected; }));
  EXPECT_TRUE(eventually(
      [&] { return host_.server().board().counts.failed_handshakes >= static_cast<std::uint64_t>(wanted); }));
  EXPECT_TRUE(is_logged("that did not say who they are in time"));
  ::kill(attacker, SIGKILL);
  ::waitpid(attacker, nullptr, 0);
  ::close(say[0]);
}

}  // namespace
}  // namespace gyre
