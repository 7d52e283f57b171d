// SPDX-License-Identifier: Apache-2.0
#include "common/http/listen_address.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(ListenAddress, IsAddressAndPort) {
  const ListenAddress all = parse_listen_address("0.0.0.0:7480").value();
  EXPECT_EQ(all.address, "0.0.0.0");
  EXPECT_EQ(all.port, 7480);
  EXPECT_TRUE(all.is_open());
  EXPECT_TRUE(all.is_every());
  EXPECT_FALSE(parse_listen_address("192.168.1.2:7480").value().is_every());
  EXPECT_EQ(parse_listen_address("[::1]:0").value().address, "::1");
  EXPECT_FALSE(parse_listen_address("[::1]:0").value().is_open());
  EXPECT_FALSE(parse_listen_address("localhost:80").value().is_open());
  for (const char* text : {"", "7480", ":7480", "0.0.0.0:", "0.0.0.0:http", "0.0.0.0:65536", "0.0.0.0:-1"}) {
    const Result<ListenAddress> parsed = parse_listen_address(text);
    ASSERT_FALSE(parsed) << text;
    EXPECT_EQ(parsed.error().kind, Error::Kind::usage);
  }
}

}  // namespace
}  // namespace gyre
