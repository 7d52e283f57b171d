// SPDX-License-Identifier: Apache-2.0
#include "common/keys/cpace.h"

#include "common/keys/pairing_code.h"

#include <gtest/gtest.h>
#include <set>

namespace gyre {
namespace {

std::string bytes(std::string_view hex) {
  std::string out;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    out += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  }
  return out;
}

// The test vector of draft-irtf-cfrg-cpace-21, appendix B.3 (ristretto255 and SHA-512).
TEST(Cpace, GivesTheDraftsVector) {
  const std::string session = bytes("7e4b4791d6a8ef019b936c79fb7f2c57");
  const std::string channel = bytes("6f630b425f726573706f6e6465720b415f696e69746961746f72");
  const std::string generator = cpace_generator("Password", channel, session);
  EXPECT_EQ(generator, bytes("a6fc82c3b8968fbb2e06fee81ca858586dea50d248f0c7ca6a18b0902a30b36b"));
  const std::string a = bytes("da3d23700a9e5699258aef94dc060dfda5ebb61f02a5ea77fad53f4ff0976d08");
  const std::string b = bytes("d2316b454718c35362d83d69df6320f38578ed5984651435e2949762d900b80d");
  const std::string share_a = cpace_multiply(a, generator);
  const std::string share_b = cpace_multiply(b, generator);
  EXPECT_EQ(share_a, bytes("d40fb265a7abeaee7939d91a585fe59f7053f982c296ec413c624c669308f87a"));
  EXPECT_EQ(share_b, bytes("08bcf6e9777a9c313a3db6daa510f2d398403319c2341bd506a92e672eb7e307"));
  const std::string secret = cpace_multiply(a, share_b);
  EXPECT_EQ(secret, bytes("e22b1ef7788f661478f3cddd4c600774fc0f41e6b711569190ff88fa0e607e09"));
  EXPECT_EQ(cpace_multiply(b, share_a), secret);
  EXPECT_EQ(cpace_session_key(session, secret, {share_a, "ADa"}, {share_b, "ADb"}),
            bytes("4c5469a16b2364c4b944ebc1a79e51d1674ad47db26e8718154f59faebfaa52d"
                  "8346f30aa58377117eb20d527f2cbc5c76381f7fd372e89df8239f87f2e02ed1"));
}

TEST(Cpace, RefusesSharesThatAreNoElementsOrTheIdentity) {
  const std::string scalar(32, '\x07');
  EXPECT_TRUE(cpace_multiply(scalar, std::string(32, '\0')).empty());    // the identity
  EXPECT_TRUE(cpace_multiply(scalar, std::string(32, '\xff')).empty());  // not canonical
  EXPECT_TRUE(cpace_multiply(scalar, std::string(31, '\x01')).empty());
  CpaceParty party(CpaceParty::Role::responder, "CODE", std::string(16, 's'), "data");
  EXPECT_FALSE(party.hear({std::string(32, '\0'), "data"}));
  EXPECT_FALSE(party.is_proof(std::string(64, '\0')));
}

struct Pair {
  CpaceParty device{CpaceParty::Role::initiator, "K7QF2M9X", "session of sixte", "device data"};
  CpaceParty host;
  explicit Pair(std::string_view host_code)
      : host(CpaceParty::Role::responder, host_code, "session of sixte", "host") {}
};

TEST(Cpace, BothSidesConvinceEachOtherWithTheSameCode) {
  Pair pair("K7QF2M9X");
  ASSERT_TRUE(pair.device.hear({pair.host.share(), "host"}));
  ASSERT_TRUE(pair.host.hear({pair.device.share(), "device data"}));
  EXPECT_TRUE(pair.host.is_proof(pair.device.proof()));
  EXPECT_TRUE(pair.device.is_proof(pair.host.proof()));
  EXPECT_FALSE(pair.device.is_proof(pair.device.proof()));  // told back to itself
  EXPECT_FALSE(pair.device.is_proof(""));
}

TEST(Cpace, AnotherCodeOrAChangedMessageConvincesNobody) {
  Pair other_code("K7QF2M9Y");
  ASSERT_TRUE(other_code.device.hear({other_code.host.share(), "host"}));
  ASSERT_TRUE(other_code.host.hear({other_code.device.share(), "device data"}));
  EXPECT_FALSE(other_code.host.is_proof(other_code.device.proof()));
  EXPECT_FALSE(other_code.device.is_proof(other_code.host.proof()));
  Pair changed("K7QF2M9X");
  ASSERT_TRUE(changed.device.hear({changed.host.share(), "host"}));
  ASSERT_TRUE(changed.host.hear({changed.device.share(), "another key"}));
  EXPECT_FALSE(changed.host.is_proof(changed.device.proof()));
  EXPECT_FALSE(changed.device.is_proof(changed.host.proof()));
}

TEST(PairingCode, IsReadAsItWasMeant) {
  EXPECT_EQ(typed_pairing_code("k7qf-2m9x"), "K7QF2M9X");
  EXPECT_EQ(typed_pairing_code(" K7QF 2M9X "), "K7QF2M9X");
  EXPECT_EQ(typed_pairing_code("oil0-0000"), "01100000");
  for (const char* no : {"", "K7QF2M9", "K7QF2M9XX", "K7QF2M9U", "K7QF_2M9X"}) EXPECT_EQ(typed_pairing_code(no), "");
  std::set<std::string> codes;
  for (int i = 0; i < 100; ++i) {
    const std::string code = new_pairing_code();
    EXPECT_EQ(typed_pairing_code(spaced_pairing_code(code)), code);
    codes.insert(code);
  }
  EXPECT_EQ(codes.size(), 100U);
}

}  // namespace
}  // namespace gyre
