// SPDX-License-Identifier: Apache-2.0
#include "common/http/access.h"

namespace gyre {

namespace {

// "name:port" or "[address]:port" without its port.
std::string_view name_of_host(std::string_view host) {
  if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

bool is_this_machine(std::string_view host) {
  const std::string_view name = name_of_host(host);
  return name == "localhost" || name == "[::1]" || is_loopback_address(name);
}

bool changes_something(std::string_view method) {
  return method != "GET" && method != "HEAD" && method != "OPTIONS";
}

bool is_dotted_quad(std::string_view text) {
  int dots = 0;
  for (const char c : text) {
    if (c == '.') ++dots;
    if (c != '.' && (c < '0' || c > '9')) return false;
  }
  return dots == 3;
}

}  // namespace

bool is_loopback_address(std::string_view address) {
  constexpr std::string_view mapped = "::ffff:";
  if (address == "::1") return true;
  if (address.starts_with(mapped)) address.remove_prefix(mapped.size());
  return address.starts_with("127.") && is_dotted_quad(address);
}

bool same_secret(std::string_view a, std::string_view b) {
  unsigned char difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
  }
  return difference == 0;
}

Access access_of(const AccessRequest& request, std::string_view token) {
  const bool has_token = !token.empty() && same_secret(request.token, token);
  if (!has_token) {
    if (!is_loopback_address(request.remote_address)) return Access::needs_token;
    if (!is_this_machine(request.host)) return Access::refused;
  }
  if (!changes_something(request.method)) return Access::granted;
  const bool own_origin = request.origin.empty() || request.origin == "http://" + request.host ||
                          request.origin == "https://" + request.host;
  return request.marked && own_origin ? Access::granted : Access::refused;
}

}  // namespace gyre
