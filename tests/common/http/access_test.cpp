// SPDX-License-Identifier: Apache-2.0
#include "common/http/access.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr const char* secret = "0123456789abcdef0123";

AccessRequest from_this_machine() {
  AccessRequest request;
  request.method = "GET";
  request.remote_address = "127.0.0.1";
  request.host = "localhost:7480";
  return request;
}

AccessRequest from_elsewhere() {
  AccessRequest request = from_this_machine();
  request.remote_address = "192.168.1.20";
  request.host = "192.168.1.2:7480";
  return request;
}

TEST(Access, IsFreeOnThisMachine) {
  for (const char* address : {"127.0.0.1", "127.8.0.3", "::1", "::ffff:127.0.0.1"}) {
    AccessRequest request = from_this_machine();
    request.remote_address = address;
    EXPECT_EQ(access_of(request, ""), Access::granted) << address;
    EXPECT_EQ(access_of(request, secret), Access::granted) << address;
  }
}

TEST(Access, NeedsTheTokenFromElsewhere) {
  for (const char* address : {"192.168.1.20", "10.0.0.1", "fe80::1", "::ffff:10.0.0.1", "1270.0.0.1", "127.evil", ""}) {
    AccessRequest request = from_elsewhere();
    request.remote_address = address;
    EXPECT_EQ(access_of(request, ""), Access::needs_token) << address;
    EXPECT_EQ(access_of(request, secret), Access::needs_token) << address;
    request.token = "0123456789abcdef0124";
    EXPECT_EQ(access_of(request, secret), Access::needs_token) << address;
    request.token = secret;
    EXPECT_EQ(access_of(request, secret), Access::granted) << address;
    EXPECT_EQ(access_of(request, ""), Access::needs_token) << address;
  }
}

TEST(Access, IsRefusedToASiteWhoseNameWasMadeToPointHere) {
  AccessRequest request = from_this_machine();
  for (const char* host : {"evil.example:7480", "evil.example", "localhost.evil.example", "127.evil.example", ""}) {
    request.host = host;
    EXPECT_EQ(access_of(request, secret), Access::refused) << host;
  }
  for (const char* host : {"localhost", "127.0.0.1:7480", "[::1]:7480"}) {
    request.host = host;
    EXPECT_EQ(access_of(request, secret), Access::granted) << host;
  }
}

TEST(Access, ToChangeSomethingIsThePagesOwn) {
  for (AccessRequest request : {from_this_machine(), from_elsewhere()}) {
    request.token = secret;
    for (const char* method : {"POST", "PUT", "DELETE", "PATCH"}) {
      request.method = method;
      request.marked = false;
      request.origin.clear();
      EXPECT_EQ(access_of(request, secret), Access::refused);
      request.marked = true;
      EXPECT_EQ(access_of(request, secret), Access::granted);
      request.origin = "http://" + request.host;
      EXPECT_EQ(access_of(request, secret), Access::granted);
      request.origin = "http://evil.example";
      EXPECT_EQ(access_of(request, secret), Access::refused);
      request.origin = "null";
      EXPECT_EQ(access_of(request, secret), Access::refused);
    }
  }
}

TEST(Access, ComparesSecretsWhole) {
  EXPECT_TRUE(same_secret("abc", "abc"));
  EXPECT_FALSE(same_secret("abc", "abcd"));
  EXPECT_FALSE(same_secret("abc", "abd"));
  EXPECT_FALSE(same_secret("", "a"));
}

}  // namespace
}  // namespace gyre
