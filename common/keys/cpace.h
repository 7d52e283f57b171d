// SPDX-License-Identifier: Apache-2.0
// CPace: two sides that know the same short code agree on a key, and whoever does not know it learns nothing from their
// messages (draft-irtf-cfrg-cpace-21, suite CPACE-RISTR255-SHA512, initiator and responder).
#pragma once

#include "common/result/result.h"

#include <string>
#include <string_view>

namespace gyre {

constexpr std::size_t cpace_share_bytes = 32;
constexpr std::size_t cpace_tag_bytes = 64;

// The functions of the draft; all strings are bytes.

// Section 7.1 and 8.3: the group element both sides derive from the code, 32 bytes.
std::string cpace_generator(std::string_view code, std::string_view channel, std::string_view session);

// scalar * element, 32 bytes each; empty when the element is not one of the group or the product is the identity, which
// must end the exchange (scalar_mult_vfy).
std::string cpace_multiply(std::string_view scalar, std::string_view element);

// Section 7.2: the key of the exchange, 64 bytes. data: what each side sends along and wants to be bound to.
struct CpaceMessage {
  std::string share;
  std::string data;
};
std::string cpace_session_key(std::string_view session, std::string_view secret, const CpaceMessage& initiator,
                              const CpaceMessage& responder);

// Section 9.4: shows that whoever sent `message` has the key, 64 bytes.
std::string cpace_tag(std::string_view session, std::string_view key, const CpaceMessage& message);

// One side of one exchange. Its secrets are wiped when it goes.
class CpaceParty {
 public:
  enum class Role { initiator, responder };

  // session: chosen at random by the initiator, the same on both sides. data: see CpaceMessage.
  CpaceParty(Role role, std::string_view code, std::string session, std::string data);
  ~CpaceParty();
  CpaceParty(CpaceParty&&) = default;
  CpaceParty& operator=(CpaceParty&&) = default;

  const std::string& share() const { return mine_.share; }

  // The other side's message. Error: its share is none.
  Result<void> hear(CpaceMessage other);

  // After hear(): what convinces the other side, and whether `tag` convinces us.
  std::string proof() const;
  bool is_proof(std::string_view tag) const;

 private:
  Role role_;
  std::string session_;
  std::string scalar_;
  std::string key_;
  CpaceMessage mine_;
  CpaceMessage other_;
};

}  // namespace gyre
