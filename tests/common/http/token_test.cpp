// SPDX-License-Identifier: Apache-2.0
#include "common/http/token.h"

#include "common/bundle/atomic_file.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

namespace gyre {
namespace {

TEST(Token, IsMadeOnceForTheOwnerOnly) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "page.token";
  const Result<std::string> first = read_or_make_token(file);
  ASSERT_TRUE(first) << first.error().message();
  EXPECT_EQ(first->size(), 40U);
  struct stat facts {};
  ASSERT_EQ(::stat(file.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0600U);
  EXPECT_EQ(read_or_make_token(file).value(), *first);
  EXPECT_NE(new_token(), new_token());
}

TEST(Token, ThatOthersMayReadIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "page.token";
  ASSERT_TRUE(read_or_make_token(file));
  ASSERT_EQ(::chmod(file.c_str(), 0644), 0);
  EXPECT_FALSE(read_or_make_token(file));
}

TEST(Token, ThatIsTooShortIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "page.token";
  ASSERT_TRUE(write_file(file, "short\n"));
  ASSERT_EQ(::chmod(file.c_str(), 0600), 0);
  EXPECT_FALSE(read_or_make_token(file));
}

}  // namespace
}  // namespace gyre
