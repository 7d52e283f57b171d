// SPDX-License-Identifier: Apache-2.0
// How a device and a host that share nothing but a one-time code come to know each other's public keys.
//
//   device                                                 host
//   PairRequest {name, public key, session, share}      ▶
//                                                       ◀  PairAnswer {public key, share}
//   PairProof {tag over the device's message}           ▶  wrong: Refused, one of five tries is gone
//                                                          right: the device goes on the list, synced
//                                                       ◀  PairDone {tag over the host's message}
//   right: the host's key is kept; wrong: nothing is
//
// The shares are CPace's (common/keys/cpace.h), the tags are keyed with what both sides then know and cover name and
// public keys. What that holds against:
//
// - Somebody who listens learns the public keys and the device's name, which are no secrets, and nothing about the
// code:
//   not even all codes tried on a recording find it.
// - Somebody in the middle, or who answers in the host's place, can put one guess of the code into each exchange, and
//   learns only whether it was right. So can somebody who asks in the device's place; the host ends the code after five
//   wrong ones, after five minutes, or when it was used: with 40 bits, a chance of 5 in 10^12. On the device's side
//   every wrong guess is a pairing that failed in front of the operator.
// - Anybody who reaches the port can use up the five tries, and the operator has to ask for another code. That is the
//   price of ending it.
// - Whoever sees the code while it is valid can pair in the device's place. It is not to be sent over the network.
//
// The port is open while a code is, and no longer; it is not the port of the link, which only ever lets in paired keys.
#pragma once

#include "common/wire/wire.h"

#include <string>

namespace zmq {
class socket_t;
}

namespace gyre {

constexpr int default_pairing_port = 7411;

// What each side binds its message to. Different for both, so that neither can be told its own.
std::string pairing_data(const wire::PairRequest& request);
std::string pairing_data(const wire::PairAnswer& answer);

// Options of both sockets of a pairing. It is not encrypted: everything said is public, or proves something.
void configure_pairing_socket(zmq::socket_t& socket);

}  // namespace gyre
