#pragma once

#include <GL/gl.h>
#include <GL/glext.h>

// What the renderer calls of OpenGL.
#define MEDULLA_GL_FUNCTIONS(X) \
  X(glActiveTexture)            \
  X(glAttachShader)             \
  X(glBindBuffer)               \
  X(glBindFramebuffer)          \
  X(glBindRenderbuffer)         \
  X(glBindTexture)              \
  X(glBindVertexArray)          \
  X(glBlendFuncSeparate)        \
  X(glBufferData)               \
  X(glCheckFramebufferStatus)   \
  X(glClear)                    \
  X(glClearColor)               \
  X(glColorMask)                \
  X(glCompileShader)            \
  X(glCreateProgram)            \
  X(glCreateShader)             \
  X(glDeleteBuffers)            \
  X(glDeleteFramebuffers)       \
  X(glDeleteProgram)            \
  X(glDeleteRenderbuffers)      \
  X(glDeleteShader)             \
  X(glDeleteTextures)           \
  X(glDeleteVertexArrays)       \
  X(glDepthFunc)                \
  X(glDepthMask)                \
  X(glDisable)                  \
  X(glDrawArrays)               \
  X(glDrawElements)             \
  X(glDrawElementsInstanced)    \
  X(glEnable)                   \
  X(glEnableVertexAttribArray)  \
  X(glFinish)                   \
  X(glFlush)                    \
  X(glFramebufferRenderbuffer)  \
  X(glFrontFace)                \
  X(glGenBuffers)               \
  X(glGenFramebuffers)          \
  X(glGenRenderbuffers)         \
  X(glGenTextures)              \
  X(glGenVertexArrays)          \
  X(glGenerateMipmap)           \
  X(glGetError)                 \
  X(glGetIntegerv)              \
  X(glGetProgramInfoLog)        \
  X(glGetProgramiv)             \
  X(glGetShaderInfoLog)         \
  X(glGetShaderiv)              \
  X(glGetString)                \
  X(glGetTexImage)              \
  X(glGetUniformLocation)       \
  X(glLinkProgram)              \
  X(glReadPixels)               \
  X(glRenderbufferStorage)      \
  X(glShaderSource)             \
  X(glTexImage2D)               \
  X(glTexParameteri)            \
  X(glTexSubImage2D)            \
  X(glUniform1f)                \
  X(glUniform1i)                \
  X(glUniform3f)                \
  X(glUniform3fv)               \
  X(glUniform4f)                \
  X(glUniformMatrix4fv)         \
  X(glUseProgram)               \
  X(glVertexAttribDivisor)      \
  X(glVertexAttribPointer)      \
  X(glViewport)

namespace medulla {

// Within medulla these pointers are found before the functions that the headers declare, which nothing links.
#define MEDULLA_DECLARE(name) extern decltype(&::name) name;  // NOLINT(bugprone-macro-parentheses)
MEDULLA_GL_FUNCTIONS(MEDULLA_DECLARE)
#undef MEDULLA_DECLARE

// From the library that a context came from; each entry leads to the calling thread's current context, so that those of
// one library serve all its contexts. Called whenever a context becomes current; contexts of two libraries are not for
// two threads at once.
using GlAddress = void (*(*)(const char* name))();  // nullptr: unknown
void useGlFunctionsOf(GlAddress address);           // throws std::runtime_error

}  // namespace medulla
