// SPDX-License-Identifier: Apache-2.0
#include "common/keys/cpace.h"

#include <sodium.h>
#include <algorithm>
#include <utility>

namespace gyre {

namespace {

constexpr std::string_view suite = "CPaceRistretto255";
constexpr std::string_view channel_name = "gyre pairing 1";
constexpr std::size_t hash_block_bytes = 128;  // of SHA-512
constexpr std::size_t hash_bytes = crypto_hash_sha512_BYTES;

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}
unsigned char* bytes_of(std::string& text) {
  return reinterpret_cast<unsigned char*>(text.data());
}

// prepend_len of the draft: the length in base 128, then the bytes.
std::string with_length(std::string_view bytes) {
  std::string out;
  std::size_t length = bytes.size();
  do {
    const std::size_t low = length & 0x7f;
    length >>= 7;
    out += static_cast<char>(length > 0 ? low | 0x80 : low);
  } while (length > 0);
  return out.append(bytes);
}

std::string sha512(std::string_view bytes) {
  std::string hash(hash_bytes, '\0');
  crypto_hash_sha512(bytes_of(hash), bytes_of(bytes), bytes.size());
  return hash;
}

void wipe(std::string& secret) {
  sodium_memzero(secret.data(), secret.size());
}

}  // namespace

std::string cpace_generator(std::string_view code, std::string_view channel, std::string_view session) {
  const std::string head = with_length(suite) + with_length(code);
  const std::size_t padding = hash_block_bytes - std::min(hash_block_bytes, head.size() + 1);
  std::string text = head + with_length(std::string(padding, '\0')) + with_length(channel) + with_length(session);
  std::string hash = sha512(text);
  std::string element(crypto_core_ristretto255_BYTES, '\0');
  crypto_core_ristretto255_from_hash(bytes_of(element), bytes_of(hash));
  wipe(text);
  wipe(hash);
  return element;
}

std::string cpace_multiply(std::string_view scalar, std::string_view element) {
  std::string product(crypto_scalarmult_ristretto255_BYTES, '\0');
  const bool sizes =
      scalar.size() == crypto_scalarmult_ristretto255_SCALARBYTES && element.size() == crypto_core_ristretto255_BYTES;
  // Fails for what is not an encoding of an element, and for the identity.
  if (!sizes || crypto_scalarmult_ristretto255(bytes_of(product), bytes_of(scalar), bytes_of(element)) != 0) return {};
  return product;
}

std::string cpace_session_key(std::string_view session, std::string_view secret, const CpaceMessage& initiator,
                              const CpaceMessage& responder) {
  std::string text = with_length(std::string(suite) + "_ISK") + with_length(session) + with_length(secret) +
                     with_length(initiator.share) + with_length(initiator.data) + with_length(responder.share) +
                     with_length(responder.data);
  std::string key = sha512(text);
  wipe(text);
  return key;
}

std::string cpace_tag(std::string_view session, std::string_view key, const CpaceMessage& message) {
  std::string text = "CPaceMac" + std::string(session) + std::string(key);
  std::string mac_key = sha512(text);
  const std::string said = with_length(message.share) + with_length(message.data);
  std::string tag(crypto_auth_hmacsha512_BYTES, '\0');
  crypto_auth_hmacsha512_state state;
  crypto_auth_hmacsha512_init(&state, bytes_of(mac_key), mac_key.size());
  crypto_auth_hmacsha512_update(&state, bytes_of(said), said.size());
  crypto_auth_hmacsha512_final(&state, bytes_of(tag));
  sodium_memzero(&state, sizeof state);
  wipe(text);
  wipe(mac_key);
  return tag;
}

CpaceParty::CpaceParty(Role role, std::string_view code, std::string session, std::string data)
    : role_(role), session_(std::move(session)), scalar_(crypto_core_ristretto255_SCALARBYTES, '\0') {
  crypto_core_ristretto255_scalar_random(bytes_of(scalar_));
  mine_ = {cpace_multiply(scalar_, cpace_generator(code, channel_name, session_)), std::move(data)};
}

CpaceParty::~CpaceParty() {
  wipe(scalar_);
  wipe(key_);
}

Result<void> CpaceParty::hear(CpaceMessage other) {
  std::string secret = cpace_multiply(scalar_, other.share);
  if (secret.empty()) return fail("not a message of a pairing", "", "start the pairing again");
  other_ = std::move(other);
  const bool first = role_ == Role::initiator;
  key_ = cpace_session_key(session_, secret, first ? mine_ : other_, first ? other_ : mine_);
  wipe(secret);
  return {};
}

std::string CpaceParty::proof() const {
  return cpace_tag(session_, key_, mine_);
}

bool CpaceParty::is_proof(std::string_view tag) const {
  const std::string expected = cpace_tag(session_, key_, other_);
  return !key_.empty() && tag.size() == expected.size() &&
         sodium_memcmp(tag.data(), expected.data(), expected.size()) == 0;
}

}  // namespace gyre
