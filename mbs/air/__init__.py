"""The air that meets a pantograph under way, and the forces that it has on head and frame."""
