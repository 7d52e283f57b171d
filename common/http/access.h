// SPDX-License-Identifier: Apache-2.0
// Who may ask a program's web server for what.
#pragma once

#include <string>
#include <string_view>

namespace gyre {

// What of a request decides whether it is answered.
struct AccessRequest {
  std::string method;          // "GET", "POST", ...
  std::string remote_address;  // of the peer, as text
  std::string host;            // header Host
  std::string origin;          // header Origin; empty when there is none
  std::string token;           // of its header Authorization or its cookie; empty when there is none
  bool marked = false;         // it has the header X-Gyre, which no other site can make a browser send
};

enum class Access {
  granted,
  needs_token,  // 401
  refused,      // 403: another site speaks through the user's browser
};

// Peers on this machine need no token; all others need the one given. An empty `token` lets nobody else in.
//
// Without a token the name the browser was given must be one of this machine (else a page of another site whose name is
// made to point here could read everything); and whatever changes something must be marked and come from the page's own
// origin, so that no other site can ask for it with the user's cookie.
Access access_of(const AccessRequest& request, std::string_view token);

// True for 127.0.0.0/8, ::1 and ::ffff:127.0.0.0/104.
bool is_loopback_address(std::string_view address);

// Equal in a time that does not tell where two texts differ.
bool same_secret(std::string_view a, std::string_view b);

}  // namespace gyre
