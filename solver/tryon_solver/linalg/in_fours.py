"""Vectors of four floats, which a GPU reads, writes and adds in one operation each, where three take three."""

from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    const float4 four = *reinterpret_cast<const float4*>(vectors.data + i);
    return wp::vec_t<3, float>(four.x, four.y, four.z);
#else
    return wp::vec_t<3, float>(vectors.data[i][0], vectors.data[i][1], vectors.data[i][2]);
#endif
""")
def three_of(vectors: wp.array(dtype=wp.vec4), i: int) -> wp.vec3:  # type: ignore[empty-body]
    """The first three numbers of vectors[i], in one operation of a GPU."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    const float4 four = *reinterpret_cast<const float4*>(vectors.data + i);
    return wp::vec_t<4, float>(four.x, four.y, four.z, four.w);
#else
    return vectors.data[i];
#endif
""")
def four_of(vectors: wp.array(dtype=wp.vec4), i: int) -> wp.vec4:  # type: ignore[empty-body]
    """vectors[i], likewise."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    *reinterpret_cast<float4*>(vectors.data + i) = make_float4(value[0], value[1], value[2], number);
#else
    vectors.data[i] = wp::vec_t<4, float>(value[0], value[1], value[2], number);
#endif
""")
def put_four(vectors: wp.array(dtype=wp.vec4), i: int, value: wp.vec3, number: float) -> None:
    """vectors[i] = (value, number), likewise."""


@wp.func_native("""
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 900
    asm volatile("red.global.add.v4.f32 [%0], {%1, %2, %3, %4};"
        :: "l"(__cvta_generic_to_global(sums.data + i)), "f"(value[0]), "f"(value[1]), "f"(value[2]), "f"(0.0f)
        : "memory");
#elif defined(__CUDA_ARCH__)
    for (int k = 0; k < 3; ++k)
        atomicAdd(reinterpret_cast<float*>(sums.data + i) + k, value[k]);
#else
    for (int k = 0; k < 3; ++k)
        sums.data[i][k] += value[k];
#endif
""")
def add_at_once(sums: wp.array(dtype=wp.vec4), i: int, value: wp.vec3) -> None:
    """sums[i] += value, in one operation where a GPU has such (PTX red.v4, from compute capability 9.0)."""
