// SPDX-License-Identifier: Apache-2.0
#include "common/http/http_client.h"

#include "common/http/http_server.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using namespace std::chrono_literals;

TEST(HttpClient, TellsAnAnswerFromNone) {
  HttpServer server{HttpOptions()};
  server.get("/thing", [](const HttpRequest&) {
    HttpResponse response;
    response.body = "there";
    return response;
  });
  ASSERT_TRUE(server.start());
  const int port = server.port();
  EXPECT_EQ(http_get("127.0.0.1", port, "/thing", "", 10s).value(), "there");
  EXPECT_FALSE(http_get("127.0.0.1", port, "/other", "", 10s));
  server.stop();
  const Result<std::optional<std::string>> nobody = http_get("127.0.0.1", port, "/thing", "", 10s);
  ASSERT_TRUE(nobody);
  EXPECT_FALSE(nobody->has_value());
}

}  // namespace
}  // namespace gyre
