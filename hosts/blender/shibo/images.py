"""The images of a material: one for each channel that is a picture. They are changed in place, so all their users follow."""
import bpy
import numpy

# Channels with numbers beyond 0 to 1, or finer than 8 bits: their images hold floats. Others hold bytes, as a PNG does.
FLOATS = ("normal", "coat_normal", "height", "anisotropy_angle", "emission", "ior")
COLORS = ("base_color", "emission")
# The property of an image that names its channel.
CHANNEL = "shibo_channel"


def samples(file, form, width, height):
    """The pixels in a file of the process as Blender takes them: floats, four for each pixel, the bottom row first.

    Raises `OSError` if the file is gone, and `ValueError` if it has another length. Uses no Blender, so a thread may call it.
    """
    pixels = numpy.fromfile(file, dtype=numpy.uint8 if form == "u8" else "<f4")
    if pixels.size != width * height * 4:
        raise ValueError(f"{file} has {pixels.size} numbers instead of {width * height * 4}")
    if form == "u8":
        return pixels.astype(numpy.float32) / numpy.float32(255)
    return pixels.astype(numpy.float32, copy=False)


def find(material, channel):
    """The image of a channel, or None."""
    entry = material.shibo.images.get(channel)
    return entry.image if entry else None


def all_of(material):
    """The images of a material, by channel."""
    return {entry.name: entry.image for entry in material.shibo.images if entry.image}


def ensure(material, channel, width, height):
    """The image of a channel, with this size."""
    image = find(material, channel)
    is_float = channel in FLOATS
    if image is None or image.is_float != is_float or image.library is not None:
        image = bpy.data.images.new(
            f"{material.name}.{channel}", width, height, alpha=False, float_buffer=is_float, is_data=channel not in COLORS)
        image[CHANNEL] = channel
        if channel in COLORS:
            image.colorspace_settings.name = "Linear Rec.709" if is_float else "sRGB"
        image.alpha_mode = "NONE"
        entry = material.shibo.images.get(channel) or material.shibo.images.add()
        entry.name, entry.image = channel, image
    if tuple(image.size) != (width, height) or image.source != "GENERATED" and image.packed_file is None:
        # A generated image takes a new size at once. `Image.scale` would compute pixels that are replaced anyway.
        if image.source != "GENERATED":
            image.source = "GENERATED"
            image.filepath = ""
        image.generated_width, image.generated_height = width, height
        if tuple(image.size) != (width, height):
            image.scale(width, height)
    return image


def write(image, pixels):
    """Replaces the pixels of an image."""
    image.pixels.foreach_set(pixels)
    image.update()


def drop(material, channel):
    """Removes the image of a channel if nothing else uses it."""
    at = material.shibo.images.find(channel)
    if at < 0:
        return
    image = material.shibo.images[at].image
    material.shibo.images.remove(at)
    if image and image.users == 0:
        bpy.data.images.remove(image)


def remove(material):
    """Removes all images of a material that nothing else uses."""
    for channel in [entry.name for entry in material.shibo.images]:
        drop(material, channel)


def tag_users(images):
    """Lets objects whose Displace modifiers read one of the images compute their shape again."""
    for thing in bpy.data.objects:
        for modifier in thing.modifiers:
            texture = modifier.texture if modifier.type == "DISPLACE" else None
            if texture is not None and texture.type == "IMAGE" and texture.image in images:
                texture.update_tag()
                thing.update_tag(refresh={"DATA"})


def pack(material):
    """Packs the images of a material that were changed since they were packed."""
    for image in all_of(material).values():
        if image.library is None and (image.packed_file is None or image.is_dirty):
            image.pack()
