// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/pairing.h"

#include "common/keys/cpace.h"
#include "common/keys/keys.h"
#include "common/keys/pairing_code.h"
#include "common/wire/pairing.h"

#include <sodium.h>
#include <optional>
#include <variant>
#include <zmq.hpp>

namespace gyre {

namespace {

using Clock = std::chrono::steady_clock;

class Exchange {
 public:
  explicit Exchange(const PairingRequest& request)
      : request_(request), end_(Clock::now() + request.patience), socket_(context_, zmq::socket_type::dealer) {
    configure_pairing_socket(socket_);
    socket_.connect(request.host);
  }

  // Once more when a crowd of strangers has pushed this device out of the host's few places. Every round is a guess for
  // whoever stands in the host's place, so that there are as few as wrong tries at the host.
  Result<std::string> hold() {
    constexpr int rounds = 5;
    Result<std::string> key = hold_once();
    for (int round = 1; round < rounds && !key && crowded_out_; ++round) key = hold_once();
    return key;
  }

 private:
  Result<std::string> hold_once() {
    crowded_out_ = false;
    wire::PairRequest first{request_.device_name, request_.public_key, std::string(wire::pair_session_bytes, '\0'), {}};
    randombytes_buf(first.session.data(), first.session.size());
    CpaceParty party(CpaceParty::Role::initiator, request_.code, first.session, pairing_data(first));
    first.share = party.share();
    if (const Result<void> sent = send(std::move(first)); !sent) return tl::unexpected(sent.error());
    const Result<wire::PairAnswer> answer = hear<wire::PairAnswer>();
    if (!answer) return tl::unexpected(answer.error());
    if (const Result<void> heard = party.hear({answer->share, pairing_data(*answer)}); !heard) {
      return tl::unexpected(heard.error());
    }
    if (const Result<void> sent = send(wire::PairProof{party.proof()}); !sent) return tl::unexpected(sent.error());
    const Result<wire::PairDone> done = hear<wire::PairDone>();
    if (!done) return tl::unexpected(done.error());
    if (party.is_proof(done->tag)) return answer->public_key;
    return fail("what answers is not the host that showed the code", request_.host,
                "somebody may be in between; nothing was kept");
  }

  Result<void> send(wire::Message message) {
    if (socket_.send(zmq::buffer(wire::encode(std::move(message))), zmq::send_flags::dontwait)) return {};
    return fail("the connection does not move", request_.host);
  }

  template <class Kind>
  Result<Kind> hear() {
    while (true) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(end_ - Clock::now());
      if (left.count() <= 0) {
        return fail("no host to pair with answers", request_.host,
                    "run `gyre-offload pair` there and use the address and the code it shows");
      }
      socket_.set(zmq::sockopt::rcvtimeo, static_cast<int>(left.count()));
      zmq::message_t body;
      if (!socket_.recv(body)) continue;
      Result<wire::Message> message = wire::decode(body.to_string_view());
      if (!message) return fail("what answers is no host of ours", request_.host + " (" + message.error().what + ")");
      if (auto* wanted = std::get_if<Kind>(&*message)) return std::move(*wanted);
      if (const auto* no = std::get_if<wire::Refused>(&*message)) {
        crowded_out_ = !no->permanent;
        return fail("the host refuses", no->reason);
      }
    }
  }

  const PairingRequest& request_;
  Clock::time_point end_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  bool crowded_out_ = false;
};

}  // namespace

Result<void> PairingRequest::check() const {
  if (!host.starts_with("tcp://")) return wrong_use("not the address of a host", host, "write it as tcp://HOST:7411");
  if (code.empty() || typed_pairing_code(code) != code) {
    return wrong_use("not a pairing code", "", "it is the eight letters and digits that `gyre-offload pair` shows");
  }
  if (!is_device_name(device_name)) {
    return wrong_use("not a device name", device_name, "use letters, digits, '-', '_' and '.', 64 at most");
  }
  if (!is_public_key(public_key)) return wrong_use("this device has no key pair");
  return {};
}

Result<std::string> pair_with_host(const PairingRequest& request) {
  try {
    return Exchange(request).hold();
  } catch (const zmq::error_t& error) {
    return fail("cannot reach the host", request.host + " (" + error.what() + ")", "check the address");
  }
}

}  // namespace gyre
