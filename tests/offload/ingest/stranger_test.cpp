// SPDX-License-Identifier: Apache-2.0
// Who is not let in, and what a device with a key may not do.
#include "common/bundle/ulid.h"
#include "common/wire/wire.h"
#include "tests/offload/ingest/link_support.h"
#include "tests/offload/ingest/raw_device.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <zmq.hpp>

namespace gyre {
namespace {

class Stranger : public testing::Test {
 protected:
  void SetUp() override {
    host_.authorise(keys_);
    host_.start();
  }
  RawDevice connected() {
    RawDevice device(host_, keys_);
    device.say(wire::Hello{wire::protocol_major, 0, "raw"});
    device.hear<wire::Welcome>();
    return device;
  }
  TestHost host_;
  KeyPair keys_ = make_key_pair();
};

TEST_F(Stranger, AnUnknownKeyIsRefusedAndLoggedAndTheDeviceSaysSo) {
  const LogCapture log;
  TestDevice device("stranger");
  device.connect(host_);
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device.spool(), scan, {1}, 1000, 1));
  const Result<void> result =
      device.uplink().wait_for_result(scan.id, {std::chrono::seconds(60), std::chrono::seconds(60)});
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find("the host does not know this device: pair it"), std::string::npos)
      << result.error().message();
  EXPECT_EQ(device.uplink().status().phase, LinkStatus::Phase::refused);
  EXPECT_TRUE(log.has("its key " + device.options().keys.public_key + " is not on the list"));
  EXPECT_FALSE(log.has(device.options().keys.secret_key.reveal()));
  EXPECT_TRUE(host_.store().scans()->empty());
  // Once it is on the list, the same device gets in, and the scan goes its way.
  host_.authorise(device.options().keys);
  EXPECT_TRUE(eventually([&] { return device.spool().phase(scan.id) == SpoolPhase::acknowledged; }));
}

TEST_F(Stranger, AHostWithAnotherKeyIsNotTrusted) {
  TestDevice device("rig");
  host_.authorise(device.options().keys);
  device.options().host_public_key = make_key_pair().public_key;
  device.options().hello_timeout = std::chrono::milliseconds(300);
  device.connect(host_);
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device.spool(), scan, {1}, 1000, 1));
  const Result<void> result =
      device.uplink().wait_for_result(scan.id, {std::chrono::milliseconds(500), std::chrono::seconds(60)});
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find("not reachable"), std::string::npos) << result.error().message();
}

TEST_F(Stranger, AnotherProtocolVersionIsRefused) {
  const LogCapture log;
  RawDevice device(host_, keys_);
  device.say(wire::Hello{wire::protocol_major + 1, 0, "raw"});
  const auto refused = device.hear<wire::Refused>();
  EXPECT_TRUE(refused.permanent);
  EXPECT_NE(refused.reason.find("protocol"), std::string::npos);
  EXPECT_TRUE(log.has(refused.reason));
}

TEST_F(Stranger, MalformedMessagesEndTheConversation) {
  RawDevice device = connected();
  device.say_bytes("\xff\xff\xff");
  EXPECT_TRUE(device.hear<wire::Refused>().permanent);
  device.say(wire::Ping{});
  EXPECT_FALSE(device.hear<wire::Refused>().permanent);  // it may start again
  device.say(wire::Hello{wire::protocol_major, 0, "raw"});
  device.hear<wire::Welcome>();
}

TEST_F(Stranger, AFloodBeyondTheCreditHurtsNobody) {
  RawDevice device = connected();
  const Scan scan = small_scan();
  device.say(wire::ScanOpen{scan.id, to_json(scan).dump()});
  device.hear<wire::ScanState>();
  const wire::FileEntry file{keyframe_name(1), 1ULL << 26, std::string(64, 'a')};
  for (std::uint64_t sent = 0; sent <= 4 * host_.options().credit_bytes; sent += wire::max_chunk_bytes) {
    device.say(wire::FileChunk{scan.id, file, file.size / 2, std::string(wire::max_chunk_bytes, 'x')});
  }
  TestDevice other("rig");
  host_.authorise(other.options().keys);
  other.connect(host_);
  const Scan mine = small_scan();
  ASSERT_TRUE(spool_scan(other.spool(), mine, {1}, 1000, 1));
  EXPECT_TRUE(eventually([&] { return other.spool().phase(mine.id) == SpoolPhase::acknowledged; }));
  EXPECT_EQ(device.hear<wire::FileResume>().offset, 0U);
}

TEST_F(Stranger, AScanOfAnotherDeviceIsOutOfReach) {
  RawDevice owner = connected();
  const Scan scan = small_scan();
  owner.say(wire::ScanOpen{scan.id, to_json(scan).dump()});
  EXPECT_EQ(owner.hear<wire::ScanState>().phase, wire::ScanPhase::receiving);

  const KeyPair keys = make_key_pair();
  host_.authorise(keys);
  RawDevice other(host_, keys);
  other.say(wire::Hello{wire::protocol_major, 0, "other"});
  other.hear<wire::Welcome>();
  other.say(wire::ScanOpen{scan.id, to_json(scan).dump()});
  EXPECT_EQ(other.hear<wire::ScanState>().phase, wire::ScanPhase::refused);
  other.say(wire::ResultRequest{scan.id, "avatar.glb", std::string(64, 'a'), 0});
  EXPECT_TRUE(other.hear<wire::Refused>().permanent);
  // The owner goes on undisturbed.
  owner.say(wire::Ping{});
  owner.hear<wire::Pong>();
}

TEST_F(Stranger, ShuttingADeviceOutEndsItsOpenConnection) {
  TestDevice device("rig");
  host_.authorise(device.options().keys);
  device.connect(host_);
  ASSERT_TRUE(eventually([&] { return device.uplink().status().phase == LinkStatus::Phase::connected; }));
  RawDevice raw = connected();
  for (const AuthorisedDevice& known : authorised_devices(host_.options().allow_list)) {
    ASSERT_TRUE(revoke_device(host_.options().allow_list, known.name));
  }
  EXPECT_TRUE(raw.hear<wire::Refused>().permanent);
  raw.say(wire::Hello{wire::protocol_major, 0, "raw"});  // on the connection that CURVE let in before
  EXPECT_NE(raw.hear<wire::Refused>().reason.find("shut out"), std::string::npos);
  EXPECT_TRUE(eventually([&] { return device.uplink().status().phase == LinkStatus::Phase::refused; }));
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device.spool(), scan, {1}, 1000, 1));
  EXPECT_FALSE(device.uplink().wait_for_result(scan.id, {std::chrono::seconds(60), std::chrono::seconds(60)}));
  EXPECT_TRUE(host_.store().scans()->empty());
}

TEST_F(Stranger, ADeviceWithoutCurveGetsNowhere) {
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::dealer);
  socket.set(zmq::sockopt::linger, 0);
  socket.set(zmq::sockopt::rcvtimeo, 300);
  socket.connect(host_.options().endpoint);
  socket.send(zmq::buffer(wire::encode(wire::Hello{})), zmq::send_flags::none);
  zmq::message_t body;
  EXPECT_FALSE(socket.recv(body));
  RawDevice device = connected();  // the host goes on
}

}  // namespace
}  // namespace gyre
