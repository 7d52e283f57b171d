// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/pairing.h"

#include "common/keys/cpace.h"
#include "common/keys/pairing_code.h"
#include "common/wire/pairing.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <array>
#include <list>
#include <optional>
#include <variant>
#include <zmq.hpp>

namespace gyre {

namespace {

using Clock = std::chrono::steady_clock;

// Exchanges begun and not proved; strangers can begin as many as they like, and the oldest make room.
constexpr std::size_t max_begun = 64;

std::string address_of(zmq::message_t& message) {
  try {
    return message.gets("Peer-Address");
  } catch (const zmq::error_t&) {
    return "?";
  }
}

}  // namespace

Result<void> PairingOptions::check() const {
  if (!endpoint.starts_with("tcp://")) return wrong_use("not an endpoint", endpoint, "write it as tcp://*:7411");
  if (!is_public_key(public_key)) return wrong_use("the host has no key pair");
  if (typed_pairing_code(code) != code || code.empty()) return wrong_use("not a pairing code");
  if (valid.count() <= 0 || max_wrong <= 0) return wrong_use("valid and max_wrong");
  return {};
}

class PairingHost::Desk {
 public:
  explicit Desk(PairingOptions options)
      : options_(std::move(options)), socket_(context_, zmq::socket_type::router), end_(Clock::now() + options_.valid) {
    configure_pairing_socket(socket_);
    socket_.bind(options_.endpoint);
  }

  std::string endpoint() const { return socket_.get(zmq::sockopt::last_endpoint); }

  Result<AuthorisedDevice> wait(const Wakeup& stop) {
    while (true) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(end_ - Clock::now());
      if (left.count() <= 0) return fail("the pairing code's time is over", "", "ask for another one");
      std::array<zmq::pollitem_t, 2> items = {
          {{socket_.handle(), 0, ZMQ_POLLIN, 0}, {nullptr, stop.descriptor(), ZMQ_POLLIN, 0}}};
      zmq::poll(items.data(), items.size(), left);
      if (items[1].revents != 0) return fail("the pairing was given up");
      if (items[0].revents == 0) continue;
      if (std::optional<Result<AuthorisedDevice>> end = receive()) return std::move(*end);
    }
  }

 private:
  using End = std::optional<Result<AuthorisedDevice>>;

  struct Begun {
    std::string peer;
    AuthorisedDevice device;
    CpaceParty party;
  };

  End receive() {
    zmq::message_t peer;
    if (!socket_.recv(peer, zmq::recv_flags::dontwait)) return std::nullopt;
    zmq::message_t body;
    bool more = peer.more();
    if (more) static_cast<void>(socket_.recv(body));
    const bool one_part = more && !body.more();
    while (more && body.more()) static_cast<void>(socket_.recv(body));
    const std::string id = peer.to_string();
    const std::string address = address_of(body);
    const Result<wire::Message> message = wire::decode(one_part ? body.to_string_view() : std::string_view());
    if (message) {
      if (const auto* request = std::get_if<wire::PairRequest>(&*message)) return begin(id, address, *request);
      if (const auto* proof = std::get_if<wire::PairProof>(&*message)) return decide(id, address, *proof);
    }
    spdlog::warn("pairing: {} sent something else than a pairing", address);
    send(id, wire::Refused{"not a message of a pairing", true});
    return std::nullopt;
  }

  End begin(const std::string& peer, const std::string& address, const wire::PairRequest& request) {
    const wire::PairAnswer from_us{options_.public_key, {}};
    CpaceParty party(CpaceParty::Role::responder, options_.code, request.session, pairing_data(from_us));
    if (const Result<void> heard = party.hear({request.share, pairing_data(request)}); !heard) {
      spdlog::warn("pairing: {} sent something else than a pairing", address);
      send(peer, wire::Refused{heard.error().message(), true});
      return std::nullopt;
    }
    begun_.remove_if([&](const Begun& before) { return before.peer == peer; });
    if (begun_.size() == max_begun) begun_.pop_front();
    send(peer, wire::PairAnswer{options_.public_key, party.share()});
    begun_.push_back({peer, {request.device_name, request.public_key}, std::move(party)});
    return std::nullopt;
  }

  End decide(const std::string& peer, const std::string& address, const wire::PairProof& proof) {
    const auto found =
        std::find_if(begun_.begin(), begun_.end(), [&](const Begun& candidate) { return candidate.peer == peer; });
    if (found == begun_.end()) {
      send(peer, wire::Refused{"this pairing has ended; start again", false});
      return std::nullopt;
    }
    Begun begun = std::move(*found);
    begun_.erase(found);
    if (!begun.party.is_proof(proof.tag)) return wrong_try(peer, address);
    if (const Result<void> noted = note(begun.device); !noted) {
      send(peer, wire::Refused{"the host cannot let this device in: " + noted.error().message(), true});
      return End(tl::unexpected(noted.error()));
    }
    spdlog::info("device {} at {} is paired; its key is {}", begun.device.name, address, begun.device.public_key);
    send(peer, wire::PairDone{begun.party.proof()});
    return End(std::move(begun.device));
  }

  // Puts the device on the list, under one name; another rig of that name must not lose its place unnoticed.
  Result<void> note(const AuthorisedDevice& device) const {
    const std::vector<AuthorisedDevice> known = authorised_devices(options_.allow_list);
    for (const AuthorisedDevice& other : known) {
      if (other.name != device.name || other.public_key == device.public_key) continue;
      return fail("another device is paired as", other.name, "revoke that one, or pair with another --name");
    }
    if (const Result<void> done = authorise_device(options_.allow_list, device.name, device.public_key); !done)
      return done;
    for (const AuthorisedDevice& before : known) {
      if (before.public_key != device.public_key || before.name == device.name) continue;
      if (const Result<void> done = revoke_device(options_.allow_list, before.name); !done) return done;
    }
    return {};
  }

  End wrong_try(const std::string& peer, const std::string& address) {
    ++wrong_;
    const int left = options_.max_wrong - wrong_;
    spdlog::warn("pairing: {} tried a wrong code; {} tries are left", address, left);
    if (left > 0) {
      send(peer, wire::Refused{"the code is wrong; " + std::to_string(left) + " tries are left", true});
      return std::nullopt;
    }
    send(peer, wire::Refused{"the code is wrong, and was tried too often: ask for another one", true});
    return End(fail("a wrong code was tried " + std::to_string(wrong_) + " times", "", "ask for another one"));
  }

  void send(const std::string& peer, wire::Message message) {
    const std::string body = wire::encode(std::move(message));
    if (socket_.send(zmq::buffer(peer), zmq::send_flags::dontwait | zmq::send_flags::sndmore))
      static_cast<void>(socket_.send(zmq::buffer(body), zmq::send_flags::dontwait));
  }

  PairingOptions options_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  Clock::time_point end_;
  int wrong_ = 0;
  std::list<Begun> begun_;  // oldest first
};

PairingHost::PairingHost(std::unique_ptr<Desk> desk) : desk_(std::move(desk)) {}
PairingHost::~PairingHost() = default;

Result<std::unique_ptr<PairingHost>> PairingHost::open(PairingOptions options) {
  const std::string endpoint = options.endpoint;
  try {
    return std::unique_ptr<PairingHost>(new PairingHost(std::make_unique<Desk>(std::move(options))));
  } catch (const zmq::error_t& error) {
    return fail("cannot listen for a device to pair", endpoint + " (" + error.what() + ")",
                "end the pairing that goes on there, or choose another endpoint");
  }
}

std::string PairingHost::endpoint() const {
  return desk_->endpoint();
}

Result<AuthorisedDevice> PairingHost::wait(const Wakeup& stop) {
  return desk_->wait(stop);
}

}  // namespace gyre
