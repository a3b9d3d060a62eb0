"""The pantograph's head: collector strips, roll, where the wire crosses, its Newmark step."""
