// SPDX-License-Identifier: Apache-2.0
// Pairing by a one-time code over real sockets: who gets in, and who does not.
#include "offload/ingest/pairing.h"

#include "common/keys/cpace.h"
#include "common/keys/pairing_code.h"
#include "common/wire/pairing.h"
#include "device/uplink/pairing.h"
#include "tests/offload/ingest/link_support.h"

#include <gtest/gtest.h>
#include <future>
#include <zmq.hpp>

namespace gyre {
namespace {

class Pairing : public testing::Test {
 protected:
  void SetUp() override { host_.start(); }
  ~Pairing() override {
    stop_.notify();
    if (outcome_.valid()) outcome_.wait();
  }

  // A host that waits for a device with the code.
  void wait_for_device(std::chrono::milliseconds valid = std::chrono::minutes(5)) {
    PairingOptions options;
    options.endpoint = "tcp://127.0.0.1:*";
    options.public_key = host_.options().keys.public_key;
    options.allow_list = host_.options().allow_list;
    options.code = code_;
    options.valid = valid;
    ASSERT_TRUE(options.check());
    Result<std::unique_ptr<PairingHost>> host = PairingHost::open(options);
    ASSERT_TRUE(host) << host.error().message();
    pairing_ = std::move(*host);
    outcome_ = std::async(std::launch::async, [this] { return pairing_->wait(stop_); });
  }
  PairingRequest request(const std::string& code, const std::string& name, const KeyPair& keys) const {
    return {pairing_->endpoint(), code, name, keys.public_key, std::chrono::seconds(30)};
  }
  std::vector<AuthorisedDevice> listed() const { return authorised_devices(host_.options().allow_list); }

  TestHost host_;
  const std::string code_ = new_pairing_code();
  std::unique_ptr<PairingHost> pairing_;
  std::future<Result<AuthorisedDevice>> outcome_;
  Wakeup stop_;
};

TEST_F(Pairing, ADeviceWithTheCodeIsLetInAndItsScansArrive) {
  const LogCapture log;
  TestDevice device("rig");
  wait_for_device();
  const Result<std::string> key = pair_with_host(request(code_, "rig-1", device.options().keys));
  ASSERT_TRUE(key) << key.error().message();
  EXPECT_EQ(*key, host_.options().keys.public_key);
  const Result<AuthorisedDevice> paired = outcome_.get();
  ASSERT_TRUE(paired) << paired.error().message();
  EXPECT_EQ(paired->name, "rig-1");
  EXPECT_EQ(paired->public_key, device.options().keys.public_key);
  EXPECT_FALSE(log.has(code_));
  EXPECT_FALSE(log.has(device.options().keys.secret_key.reveal()));
  device.connect(host_);
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device.spool(), scan, {1}, 1000, 1));
  EXPECT_TRUE(eventually([&] { return device.spool().phase(scan.id) == SpoolPhase::acknowledged; }));
}

TEST_F(Pairing, FourWrongTriesAreForgivenTheFifthEndsTheCode) {
  const LogCapture log;
  const KeyPair keys = make_key_pair();
  wait_for_device();
  for (int left = 4; left > 0; --left) {
    const Result<std::string> wrong = pair_with_host(request(new_pairing_code(), "rig", keys));
    ASSERT_FALSE(wrong);
    const std::string message = wrong.error().message();
    EXPECT_NE(message.find("; " + std::to_string(left) + " tries are left"), std::string::npos) << message;
  }
  EXPECT_TRUE(log.has("tried a wrong code; 1 tries are left"));
  EXPECT_TRUE(listed().empty());
  ASSERT_TRUE(pair_with_host(request(code_, "rig", keys)));
  ASSERT_TRUE(outcome_.get());

  wait_for_device();
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(pair_with_host(request(new_pairing_code(), "stranger", make_key_pair())));
  const Result<AuthorisedDevice> ended = outcome_.get();
  ASSERT_FALSE(ended);
  EXPECT_NE(ended.error().message().find("5 times"), std::string::npos);
  EXPECT_EQ(listed().size(), 1U);
}

TEST_F(Pairing, ACodeIsOverAfterItsTime) {
  wait_for_device(std::chrono::milliseconds(1));
  const Result<AuthorisedDevice> ended = outcome_.get();
  ASSERT_FALSE(ended);
  EXPECT_NE(ended.error().message().find("time is over"), std::string::npos);
}

TEST_F(Pairing, AnotherRigOfTheSameNameDoesNotTakeItsPlace) {
  const KeyPair first = make_key_pair();
  host_.authorise(first);
  const std::string name = listed().front().name;
  wait_for_device();
  const Result<std::string> refused = pair_with_host(request(code_, name, make_key_pair()));
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message().find("another device is paired as"), std::string::npos);
  EXPECT_FALSE(outcome_.get());
  EXPECT_EQ(listed().front().public_key, first.public_key);
  // The rig itself may come back, under its name or another: it is one device.
  wait_for_device();
  ASSERT_TRUE(pair_with_host(request(code_, "renamed", first)));
  ASSERT_TRUE(outcome_.get());
  ASSERT_EQ(listed().size(), 1U);
  EXPECT_EQ(listed().front().name, "renamed");
}

TEST_F(Pairing, StrangersNoiseDoesNotKeepADeviceOut) {
  wait_for_device();
  zmq::context_t context;
  std::vector<zmq::socket_t> strangers;
  for (int i = 0; i < 200; ++i) {
    zmq::socket_t& socket = strangers.emplace_back(context, zmq::socket_type::dealer);
    configure_pairing_socket(socket);
    socket.set(zmq::sockopt::linger, 0);
    socket.connect(pairing_->endpoint());
    const std::string session(wire::pair_session_bytes, static_cast<char>(i));
    CpaceParty party(CpaceParty::Role::initiator, "GUESS", session, "x");
    const KeyPair keys = make_key_pair();
    socket.send(zmq::buffer(wire::encode(wire::PairRequest{"noise", keys.public_key, session, party.share()})),
                zmq::send_flags::none);
    socket.send(zmq::buffer(std::string(100, static_cast<char>(i))), zmq::send_flags::none);
    if (i % 10 == 0) socket.send(zmq::buffer(std::string(5000, 'x')), zmq::send_flags::none);
    if (i % 10 == 1) socket.send(zmq::buffer(wire::encode(wire::Hello{1, 0, "rig"})), zmq::send_flags::none);
  }
  const KeyPair keys = make_key_pair();
  const Result<std::string> key = pair_with_host(request(code_, "rig", keys));
  ASSERT_TRUE(key) << key.error().message();
  EXPECT_TRUE(outcome_.get());
  ASSERT_EQ(listed().size(), 1U);
  EXPECT_EQ(listed().front().public_key, keys.public_key);
}

TEST_F(Pairing, SomebodyInTheHostsPlaceIsNotBelieved) {
  zmq::context_t context;
  zmq::socket_t impostor(context, zmq::socket_type::router);
  configure_pairing_socket(impostor);
  impostor.bind("tcp://127.0.0.1:*");
  const KeyPair its_keys = make_key_pair();
  std::thread answers([&] {
    zmq::message_t peer;
    zmq::message_t body;
    const auto reply = [&](const wire::Message& message) {
      impostor.send(zmq::buffer(peer.to_string()), zmq::send_flags::sndmore);
      impostor.send(zmq::buffer(wire::encode(message)), zmq::send_flags::none);
    };
    ASSERT_TRUE(impostor.recv(peer) && impostor.recv(body));
    const auto asked = std::get<wire::PairRequest>(wire::decode(body.to_string_view()).value());
    CpaceParty guess(CpaceParty::Role::responder, "GUESSED1", asked.session, "host " + its_keys.public_key);
    ASSERT_TRUE(guess.hear({asked.share, pairing_data(asked)}));
    reply(wire::PairAnswer{its_keys.public_key, guess.share()});
    ASSERT_TRUE(impostor.recv(peer) && impostor.recv(body));
    const auto proof = std::get<wire::PairProof>(wire::decode(body.to_string_view()).value());
    EXPECT_FALSE(guess.is_proof(proof.tag));  // all it learns: that its one guess was wrong
    reply(wire::PairDone{guess.proof()});
  });
  const PairingRequest request{impostor.get(zmq::sockopt::last_endpoint), code_, "rig", make_key_pair().public_key,
                               std::chrono::seconds(30)};
  const Result<std::string> key = pair_with_host(request);
  answers.join();
  ASSERT_FALSE(key);
  EXPECT_NE(key.error().message().find("not the host that showed the code"), std::string::npos);
}

TEST_F(Pairing, NobodyThereIsASentence) {
  PairingRequest request{"tcp://127.0.0.1:1", code_, "rig", make_key_pair().public_key, std::chrono::milliseconds(50)};
  const Result<std::string> key = pair_with_host(request);
  ASSERT_FALSE(key);
  EXPECT_NE(key.error().message().find("run `gyre-offload pair` there"), std::string::npos);
  request.host = "workstation";
  EXPECT_EQ(request.check().error().exit_code(), 2);
}

}  // namespace
}  // namespace gyre
